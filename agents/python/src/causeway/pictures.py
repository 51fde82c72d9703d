"""Pictures of worlds of a batch, drawn by the renderers of a running site::

    with Batch("lane-keep", worlds=8, town="Town02") as batch, Renderer() as renderer:
        pictures = renderer.draw(batch.frames(range(8)), Camera(width=256, height=144))
        pixels = renderer.pixels(batch.frames(range(8)), Camera(width=84, height=84))

Worlds of a batch are on no bus; a site (`causeway up`) draws them all the same, as a job for its
renderers holds all there is to see but the town, which the site must have.

**Frames:** of the vehicle that carries the camera: x forward, y left, z up from the ground under
the middle of its box; metres.
"""

from __future__ import annotations

import itertools
import math
import struct
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from types import TracebackType
from typing import Any

import flatbuffers
import numpy as np
from numpy.typing import NDArray

from causeway.bus import DEFAULT_ENDPOINT, DEFAULT_TENANT, Identity, join
from causeway.rollout import WorldFrame
from causeway.wire import Camera as fb_camera
from causeway.wire import RenderJob as fb_job
from causeway.wire.Error import Error
from causeway.wire.ImageEncoding import ImageEncoding
from causeway.wire.ImageKind import ImageKind
from causeway.wire.Images import Images
from causeway.wire.PictureQuality import PictureQuality
from causeway.wire.Pose import CreatePose
from causeway.wire.Reply import Reply
from causeway.wire.ReplyBody import ReplyBody

__all__ = ["Camera", "Renderer", "RendererError", "jobs"]

#: Jobs of one renderer that wait at a time.
JOBS_MAX = 64
#: How long the site may take for all pictures of one call, for each of them.
DRAW_SECS = 30.0
JPEG = b"\xff\xd8"
#: Where a camera has its carrier (`wire/Camera.py`).
CARRIER = 6
TIERS = {None: PictureQuality.Site, "low": PictureQuality.Low, "high": PictureQuality.High}


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
    #: How finely colours are drawn: low, high, or as the site was told.
    tier: str | None = None

    @classmethod
    def parse(cls, text: str) -> Camera:
        """Of `WIDTHxHEIGHT`.

        Raises:
            ValueError: it is no such text.
        """
        width, times, height = text.partition("x")
        if not (times and width.isdecimal() and height.isdecimal() and int(width) and int(height)):
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
        pictures = [bytes(data) for data in self._drawn(jobs(frames, camera, tenant=self._tenant))]
        if not all(data.startswith(JPEG) for data in pictures):
            raise RendererError("the renderer sent something else than JPEG")
        return pictures

    def pixels(self, frames: Sequence[WorldFrame], camera: Camera) -> NDArray[np.uint8]:
        """The same without loss, of shape ``(frames, height, width, 3)``: red, green, blue.

        Raises:
            RendererError: as for :meth:`draw`.
        """
        pictures = np.empty((len(frames), camera.height, camera.width, 4), np.uint8)
        drawn = self._drawn(jobs(frames, camera, tenant=self._tenant, raw=True))
        for picture, data in zip(pictures, drawn, strict=True):
            if data.size != picture.size:
                raise RendererError(f"the renderer sent {data.size} bytes, not {picture.size}")
            picture[:] = data.reshape(picture.shape)
        return pictures[..., :3]

    def _drawn(self, wanted: Iterator[bytes]) -> Iterator[NDArray[np.uint8]]:
        """The pictures of jobs, in order; so many are asked for as renderers let wait."""
        names = self._renderers()
        turns = (f"causeway/render/{names[at % len(names)]}/job" for at in itertools.count())
        asked = (
            self._session.get(key, payload=job, timeout=DRAW_SECS)
            for key, job in zip(turns, wanted, strict=False)
        )
        waiting = deque(islice(asked, JOBS_MAX * len(names)))
        while waiting:
            yield _picture(waiting.popleft())
            waiting.extend(islice(asked, 1))

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


def jobs(
    frames: Sequence[WorldFrame], camera: Camera, *, tenant: str = DEFAULT_TENANT, raw: bool = False
) -> Iterator[bytes]:
    """The message that asks a renderer for the picture of each world.

    Raises:
        RendererError: a world has no agent, or there is no such tier.
    """
    if camera.tier not in TIERS:
        raise RendererError(f"a tier is low, high or None, not {camera.tier!r}")
    # They differ in the frame and the car alone: each of another length is made once.
    forms: dict[int, bytearray] = {}
    for frame in frames:
        if not frame.cars:
            raise RendererError("the world has no agent that could carry a camera")
        size = len(frame.data)
        if size not in forms:
            forms[size] = _form(size, camera, tenant, raw)
        form = forms[size]
        job = fb_job.RenderJob.GetRootAs(form)
        job.FrameAsNumpy()[:] = np.frombuffer(frame.data, np.uint8)
        carrier = job.Cameras(0)._tab
        struct.pack_into("<I", form, carrier.Pos + carrier.Offset(CARRIER), frame.cars[0])
        yield bytes(form)


def _form(frame_bytes: int, camera: Camera, tenant: str, raw: bool) -> bytearray:
    """A job in which the frame and the car are still to be written."""
    builder: Any = flatbuffers.Builder(frame_bytes + 1024)
    name = builder.CreateString(tenant)
    data = builder.CreateByteVector(bytes(frame_bytes))
    fb_camera.CameraStart(builder)
    fb_camera.CameraAddId(builder, 1)
    fb_camera.CameraAddCarrier(builder, 1)
    # A positive turn about y (left) looks down.
    half = math.radians(camera.down_degrees) / 2.0
    place = (camera.forward_m, 0.0, camera.up_m)
    pose = CreatePose(builder, *place, 0.0, math.sin(half), 0.0, math.cos(half))
    fb_camera.CameraAddCarrierFromCamera(builder, pose)
    fb_camera.CameraAddWidthPx(builder, camera.width)
    fb_camera.CameraAddHeightPx(builder, camera.height)
    fb_camera.CameraAddHorizontalFovRad(builder, math.radians(camera.fov_degrees))
    fb_camera.CameraAddKind(builder, ImageKind.Rgb)
    fb_camera.CameraAddEncoding(builder, ImageEncoding.Rgba8 if raw else ImageEncoding.Jpeg)
    fb_camera.CameraAddJpegQuality(builder, camera.quality)
    fb_camera.CameraAddQuality(builder, TIERS[camera.tier])
    only = fb_camera.CameraEnd(builder)
    fb_job.RenderJobStartCamerasVector(builder, 1)
    builder.PrependUOffsetTRelative(only)
    cameras = builder.EndVector()
    fb_job.RenderJobStart(builder)
    fb_job.RenderJobAddTenant(builder, name)
    fb_job.RenderJobAddFrame(builder, data)
    fb_job.RenderJobAddCameras(builder, cameras)
    builder.Finish(fb_job.RenderJobEnd(builder), file_identifier=b"CWRJ")
    return bytearray(builder.Output())


def _picture(replies: Any) -> NDArray[np.uint8]:
    for answer in replies:
        told = answer.ok or answer.err
        payload = told.payload.to_bytes()
        # What the bus says by itself when nobody answers in time.
        if payload == b"Timeout":
            break
        reply = Reply.GetRootAs(payload)
        body = reply.Body()
        if body is not None and reply.BodyType() == ReplyBody.Images:
            images = Images()
            images.Init(body.Bytes, body.Pos)
            data: NDArray[np.uint8] = images.Images(0).DataAsNumpy()
            return data
        if body is not None and reply.BodyType() == ReplyBody.Error:
            error = Error()
            error.Init(body.Bytes, body.Pos)
            raise RendererError(_text(error))
    raise RendererError(f"no renderer answered within {DRAW_SECS:.0f} s")


def _text(error: Any) -> str:
    """What was wrong, what would not have been, and what was found."""
    message, wanted, found = (
        (part or b"").decode() for part in (error.Message(), error.Wanted(), error.Found())
    )
    details = [f"{name} {part}" for name, part in (("wanted", wanted), ("found", found)) if part]
    return f"{message or 'no picture'}{': ' if details else ''}{', '.join(details)}"
