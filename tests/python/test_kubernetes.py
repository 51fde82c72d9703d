"""Goal: the tree of deploy/k8s is valid, sealed, and its pods are a site.

Method: build overlays with `kubectl kustomize`, check each object against Kubernetes' own schemas
and the rules that the tree promises, and run the containers of one overlay, as its pods say, on an
engine.
"""

import contextlib
import os
import re
import shutil
import subprocess
import time
from pathlib import Path

import kubernetes_validate
import pytest
import yaml

from containers import CORE, FULL, ROOT, docker, drive
from running_site import two_free_ports

TREE = ROOT / "deploy" / "k8s"
OVERLAYS = sorted(path.name for path in (TREE / "overlays").iterdir())
#: The oldest and the newest that are checked.
VERSIONS = ("1.29", "1.37")
READY_SECS = 60.0


def built(folder: Path) -> list[dict]:
    """The objects that `kubectl apply -k` would send."""
    kubectl = shutil.which("kubectl")
    if kubectl is None:
        pytest.skip("no kubectl")
    done = subprocess.run([kubectl, "kustomize", folder], capture_output=True, timeout=60)
    said = done.stderr.decode()
    if re.search("(unknown|invalid).*Component|unknown command", said):
        pytest.skip("no kubectl that knows components")
    assert done.returncode == 0, said
    return [one for one in yaml.safe_load_all(done.stdout) if one]


@pytest.fixture(params=OVERLAYS)
def objects(request) -> list[dict]:
    return built(TREE / "overlays" / request.param)


def workloads(objects: list[dict]) -> list[dict]:
    return [one for one in objects if one["kind"] in ("Deployment", "StatefulSet")]


def pod_of(workload: dict) -> dict:
    return workload["spec"]["template"]["spec"]


def container_of(workload: dict) -> dict:
    (container,) = pod_of(workload)["containers"]
    return container


def name_of(one: dict) -> str:
    return one["metadata"]["name"]


def labels_of(workload: dict) -> dict[str, str]:
    return workload["spec"]["template"]["metadata"]["labels"]


@pytest.mark.parametrize("version", VERSIONS)
def test_every_object_is_one_of_kubernetes(objects, version):
    for one in objects:
        kubernetes_validate.validate(one, version, strict=True)


def test_a_misspelt_field_is_found(objects):
    wrong = workloads(objects)[0]
    pod_of(wrong)["terminationGraceSeconds"] = 1
    with pytest.raises(kubernetes_validate.ValidationError):
        kubernetes_validate.validate(wrong, VERSIONS[-1], strict=True)


def test_pods_have_no_more_rights_than_they_need(objects):
    assert len(workloads(objects)) == 6
    for workload in workloads(objects):
        pod, container = pod_of(workload), container_of(workload)
        assert pod["automountServiceAccountToken"] is False
        assert pod["securityContext"]["runAsNonRoot"] is True
        assert pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
        assert container["securityContext"] == {
            "allowPrivilegeEscalation": False,
            "capabilities": {"drop": ["ALL"]},
            "readOnlyRootFilesystem": True,
        }
        assert re.fullmatch(r"causeway(-core)?:\d+\.\d+\.\d+", container["image"])
        assert "memory" in container["resources"]["limits"]
        assert {"cpu", "memory"} <= container["resources"]["requests"].keys()


def test_pods_are_probed_and_may_drain(objects):
    for workload in workloads(objects):
        container = container_of(workload)
        ports = {port["name"]: port["containerPort"] for port in container["ports"]}
        env = {one["name"]: one.get("value") for one in container["env"]}
        assert env["CAUSEWAY_ADMIN"] == f"0.0.0.0:{ports['admin']}"
        for probe, path in (
            ("startup", "startupz"),
            ("liveness", "livez"),
            ("readiness", "readyz"),
        ):
            asked = container[f"{probe}Probe"]["httpGet"]
            assert asked == {"path": f"/{path}", "port": "admin"}
        drain = re.search(r"--drain-secs[= ](\d+)", " ".join(container["args"]))
        grace = pod_of(workload)["terminationGracePeriodSeconds"]
        assert drain is None or grace >= int(drain.group(1)) + 10


def test_services_and_policies_name_pods_and_ports_that_are_there(objects):
    pods = {
        name_of(workload): (labels_of(workload), container_of(workload)["ports"])
        for workload in workloads(objects)
    }

    def chosen(labels: dict[str, str]) -> list[list[dict]]:
        return [ports for has, ports in pods.values() if labels.items() <= has.items()]

    for service in (one for one in objects if one["kind"] == "Service"):
        behind = chosen(service["spec"]["selector"])
        assert len(behind) == 1, name_of(service)
        there = {port["containerPort"] for port in behind[0]}
        named = {port["name"]: port["containerPort"] for port in behind[0]}
        for port in service["spec"]["ports"]:
            target = port.get("targetPort", port["port"])
            assert named.get(target, target) in there
    served = set()
    for policy in (one for one in objects if one["kind"] == "NetworkPolicy"):
        for rule in policy["spec"].get("ingress", []):
            labels = policy["spec"]["podSelector"].get("matchLabels", {})
            names = {port["name"] for ports in chosen(labels) for port in ports}
            wanted = {port["port"] for port in rule["ports"]}
            assert wanted <= names, name_of(policy)
            served |= wanted
    everything = {port["name"] for _, ports in pods.values() for port in ports}
    assert served | {"admin"} == everything
    closed = next(one for one in objects if name_of(one) == "nothing-else")
    assert closed["spec"] == {"podSelector": {}, "policyTypes": ["Ingress", "Egress"]}


def test_the_shared_server_asks_for_tokens_and_a_gpu():
    by_name = {name_of(one): one for one in workloads(built(TREE / "overlays" / "gpu"))}
    # The gateway knows quotas by it.
    for face in ("scenario", "gateway"):
        env = {one["name"]: one["value"] for one in container_of(by_name[face])["env"]}
        assert "CAUSEWAY_OPEN" not in env
        (mount,) = (
            mount
            for mount in container_of(by_name[face])["volumeMounts"]
            if env["CAUSEWAY_TOKENS"].startswith(mount["mountPath"])
        )
        assert mount["readOnly"] is True
        (volume,) = (one for one in pod_of(by_name[face])["volumes"] if one["name"] == "tokens")
        assert volume["secret"]["secretName"] == "tokens"
    assert container_of(by_name["render"])["resources"]["limits"]["nvidia.com/gpu"] == "1"
    assert by_name["render"]["spec"]["strategy"]["rollingUpdate"]["maxSurge"] == 0


def test_the_shared_server_has_certificates_on_its_bus():
    roles = {}
    for workload in workloads(built(TREE / "overlays" / "gpu")):
        container, pod = container_of(workload), pod_of(workload)
        env = {one["name"]: one["value"] for one in container["env"]}
        (mount,) = (one for one in container["volumeMounts"] if one["name"] == "bus")
        files = [env[f"CAUSEWAY_BUS_{name}"] for name in ("CA", "CERT", "KEY")]
        assert files == [
            f"{mount['mountPath']}/{file}" for file in ("ca.crt", "tls.crt", "tls.key")
        ]
        told = " ".join([*container["args"], env.get("CAUSEWAY_BUS", "")])
        assert "tls/router-" in told
        assert "tcp/" not in told
        (volume,) = (one for one in pod["volumes"] if one["name"] == "bus")
        roles[name_of(workload)] = volume["secret"]["secretName"].removeprefix("bus-")
    assert roles == {
        "router-0": "router",
        "router-1": "router",
        "world": "world",
        "render": "render",
        "scenario": "face",
        "gateway": "face",
    }


@contextlib.contextmanager
def pods(workloads_: list[dict], project: str, published: dict[str, list[str]]):
    """Runs the container of each workload as its pod says, under the name of its Service.

    `published` has the flags of `docker run` of single workloads."""
    network = f"{project}-net"
    docker("network", "create", network)
    names = []
    try:
        for workload in workloads_:
            container, name = container_of(workload), name_of(workload)
            user = pod_of(workload)["securityContext"]
            env = [
                word
                for one in container["env"]
                for word in ("--env", f"{one['name']}={one['value']}")
            ]
            mounts = [
                word
                for mount in container["volumeMounts"]
                for word in ("--tmpfs", f"{mount['mountPath']}:mode=1777")
            ]
            names.append(f"{project}-{name}")
            docker(
                *("run", "--detach", "--name", names[-1], "--network", network),
                *("--network-alias", name, "--read-only", "--cap-drop", "ALL"),
                *("--security-opt", "no-new-privileges:true"),
                *("--user", f"{user['runAsUser']}:{user['runAsGroup']}"),
                *env, *mounts, *published.get(name, []),
                FULL if container["image"].startswith("causeway:") else CORE,
                *container["args"],
            )  # fmt: skip
        yield names
    finally:
        subprocess.run(["docker", "rm", "--force", *names], capture_output=True)
        subprocess.run(["docker", "network", "rm", network], capture_output=True)


@pytest.mark.usefixtures("images")
def test_what_its_pods_run_is_a_site_that_outlives_a_router():
    http, port = two_free_ports(), two_free_ports()
    of_site = workloads(built(TREE / "overlays" / "laptop"))
    for workload in of_site:
        if name_of(workload) == "gateway":
            # The number inside is the one outside; a cluster has an address for each Service.
            args = container_of(workload)["args"]
            args[args.index("--port=2000")] = f"--port={port}"
    published = {
        "scenario": ["-p", f"127.0.0.1:{http}:8000"],
        "gateway": [word for p in (port, port + 1) for word in ("-p", f"127.0.0.1:{p}:{p}")],
    }
    project = f"causeway-test-{os.getpid()}"
    with pods(of_site, project, published) as names:
        wait_until_ready(names)
        drive(f"http://127.0.0.1:{http}", port)
        docker("kill", f"{project}-router-0")
        wait_until_ready([name for name in names if not name.endswith("router-0")])
        drive(f"http://127.0.0.1:{http}", port)


def wait_until_ready(names: list[str]) -> None:
    """Each answers the question of its readiness probe, asked in its container."""
    deadline = time.monotonic() + READY_SECS
    for name in names:
        ask = ["docker", "exec", name, "/usr/bin/causeway", "health", "--ready"]
        while (done := subprocess.run(ask, capture_output=True)).returncode != 0:
            if time.monotonic() > deadline:
                said = done.stderr.decode() + docker("logs", "--tail", "20", name)
                pytest.fail(f"{name} does not become ready: {said}", pytrace=False)
            time.sleep(0.2)
