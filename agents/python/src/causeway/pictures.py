"""Pictures of worlds of a batch, drawn by the renderers of a running site::

    with Batch("lane-keep", worlds=8, town="Town02") as batch, Renderer() as renderer:
        pictures = renderer.draw(batch.frames(range(8)), Camera(width=256, height=144))

Worlds of a batch are on no bus; a site (`causeway up`) draws them all the same, as a job for its
renderers holds all there is to see but the town, which the site must have.

**Frames:** of the vehicle that carries the camera: x forward, y left, z up from the ground under
the middle of its box; metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import flatbuffers

from causeway.bus import DEFAULT_ENDPOINT, DEFAULT_TENANT, Identity, join
from causeway.rollout import WorldFrame
from causeway.wire import Camera as fb_camera
from causeway.wire import RenderJob as fb_job
from causeway.wire.Error import Error
from causeway.wire.ImageEncoding import ImageEncoding
from causeway.wire.ImageKind import ImageKind
from causeway.wire.Images import Images
from causeway.wire.Pose import CreatePose
from causeway.wire.Reply import Reply
from causeway.wire.ReplyBody import ReplyBody

__all__ = ["Camera", "Renderer", "RendererError"]

#: Jobs of one renderer that wait at a time.
JOBS_MAX = 64
#: How long the site may take for all pictures of one call, for each of them.
DRAW_SECS = 30.0
JPEG = b"\xff\xd8"


class RendererError(RuntimeError):
    """Nobody draws, or what was asked for cannot be drawn."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera on a vehicle, which looks ahead and a little down."""

    width: int = 256
    height: int = 144
    fov_degrees: float = 90.0
    forward_m: float = 2.0
    up_m: float = 1.4
    down_degrees: float = 8.0
    #: 1 to 100, of JPEG.
    quality: int = 90

    @classmethod
    def parse(cls, text: str) -> Camera:
        """Of `WIDTHxHEIGHT`.

        Raises:
            ValueError: it is no such text.
        """
        width, times, height = text.partition("x")
        if not (times and width.isdecimal() and height.isdecimal()):
            raise ValueError(f"a camera is WIDTHxHEIGHT, as 256x144, not {text!r}")
        return cls(width=int(width), height=int(height))


class Renderer:
    """The renderers of a site, in turn; a context manager."""

    def __init__(
        self,
        endpoint: str = DEFAULT_ENDPOINT,
        *,
        tenant: str = DEFAULT_TENANT,
        identity: Identity | None = None,
    ) -> None:
        """Joins a bus.

        Raises:
            ConnectionError: nobody listens at `endpoint`.
        """
        self._tenant = tenant
        self._session = join(endpoint, identity=identity)

    def draw(self, frames: Sequence[WorldFrame], camera: Camera) -> list[bytes]:
        """What the first agent of each world sees, as JPEG. All are asked for at once.

        Raises:
            RendererError: nobody draws, or a picture cannot be drawn; the text says why.
        """
        names = self._renderers()
        pictures: list[bytes] = []
        for first in range(0, len(frames), JOBS_MAX * len(names)):
            part = frames[first : first + JOBS_MAX * len(names)]
            asked = [
                self._session.get(
                    f"causeway/render/{names[at % len(names)]}/job",
                    payload=_job(frame, camera, self._tenant),
                    timeout=DRAW_SECS,
                )
                for at, frame in enumerate(part)
            ]
            pictures += [_picture(replies) for replies in asked]
        return pictures

    def _renderers(self) -> list[str]:
        told = self._session.liveliness().get("causeway/alive/render/*", timeout=5.0)
        names = sorted(str(reply.ok.key_expr).rpartition("/")[2] for reply in told if reply.ok)
        if not names:
            raise RendererError("the site has no renderer: `causeway up` starts one")
        return names

    def close(self) -> None:
        """Leaves the bus."""
        self._session.close()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _job(frame: WorldFrame, camera: Camera, tenant: str) -> bytes:
    if not frame.cars:
        raise RendererError("the world has no agent that could carry a camera")
    builder: Any = flatbuffers.Builder(len(frame.data) + 1024)
    name = builder.CreateString(tenant)
    data = builder.CreateByteVector(frame.data)
    fb_camera.CameraStart(builder)
    fb_camera.CameraAddId(builder, 1)
    fb_camera.CameraAddCarrier(builder, frame.cars[0])
    # A positive turn about y (left) looks down.
    half = math.radians(camera.down_degrees) / 2.0
    place = (camera.forward_m, 0.0, camera.up_m)
    pose = CreatePose(builder, *place, 0.0, math.sin(half), 0.0, math.cos(half))
    fb_camera.CameraAddCarrierFromCamera(builder, pose)
    fb_camera.CameraAddWidthPx(builder, camera.width)
    fb_camera.CameraAddHeightPx(builder, camera.height)
    fb_camera.CameraAddHorizontalFovRad(builder, math.radians(camera.fov_degrees))
    fb_camera.CameraAddKind(builder, ImageKind.Rgb)
    fb_camera.CameraAddEncoding(builder, ImageEncoding.Jpeg)
    fb_camera.CameraAddJpegQuality(builder, camera.quality)
    only = fb_camera.CameraEnd(builder)
    fb_job.RenderJobStartCamerasVector(builder, 1)
    builder.PrependUOffsetTRelative(only)
    cameras = builder.EndVector()
    fb_job.RenderJobStart(builder)
    fb_job.RenderJobAddTenant(builder, name)
    fb_job.RenderJobAddFrame(builder, data)
    fb_job.RenderJobAddCameras(builder, cameras)
    builder.Finish(fb_job.RenderJobEnd(builder), file_identifier=b"CWRJ")
    return bytes(builder.Output())


def _picture(replies: Any) -> bytes:
    for answer in replies:
        if answer.ok is None:
            continue
        reply = Reply.GetRootAs(answer.ok.payload.to_bytes())
        body = reply.Body()
        if body is not None and reply.BodyType() == ReplyBody.Images:
            images = Images()
            images.Init(body.Bytes, body.Pos)
            data = bytes(images.Images(0).DataAsNumpy())
            if data.startswith(JPEG):
                return data
        if body is not None and reply.BodyType() == ReplyBody.Error:
            error = Error()
            error.Init(body.Bytes, body.Pos)
            raise RendererError((error.Message() or b"no picture").decode())
    raise RendererError(f"no renderer answered within {DRAW_SECS:.0f} s")
