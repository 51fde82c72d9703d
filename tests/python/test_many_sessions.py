"""More sessions than a shell's limit of open files lets a service have."""

import resource
from contextlib import ExitStack

import httpx

from wire import wire

#: Of the site, far below the sockets that the clients of this test need.
SOFT_LIMIT = 200
CONNECTIONS = 300
FORKS = 1_024


def test_a_thousand_sessions_are_forked_while_hundreds_are_connected(start_site):
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(max(soft, 4_096), hard), hard))
    limited = ("sh", "-c", f'ulimit -Sn {SOFT_LIMIT} && exec "$0" "$@"')
    site = start_site("--no-render", within=limited, MAX_CONCURRENT_ENVS="1400")
    with ExitStack() as stack:
        connected = [stack.enter_context(wire(site.base_url)) for _ in range(CONNECTIONS)]
        assert connected[-1].reset()["done"] is False
        http = stack.enter_context(httpx.Client(base_url=site.base_url, timeout=120.0))
        origin = http.post("/reset", json={"session_id": "", "seed": 3}).json()
        name = origin["metadata"]["session_id"]
        forked = http.post("/fork", json={"session_id": name, "count": FORKS})
        assert forked.status_code == 200, forked.text
        branches = forked.json()["session_ids"]
        assert len(set(branches)) == FORKS

        def step(session):
            action = {"action_type": "observe"}
            reply = http.post("/step", json={"action": action, "session_id": session}).json()
            return reply["observation"]["metadata"]["sim"]["state_hash"]

        assert len({step(session) for session in (name, branches[0], branches[-1])}) == 1
        refused = http.post("/fork", json={"session_id": name, "count": FORKS})
        assert refused.status_code == 503 and "capacity" in refused.text, refused.text
        assert connected[0].reset()["done"] is False
