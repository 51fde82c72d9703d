"""Subscribes to frames with one kind of transport, says so, and reads on until it is stopped."""

import sys
import time

import zenoh

endpoint, mode, low_latency = sys.argv[1:]
config = zenoh.Config()
for name, value in {
    "mode": f'"{mode}"',
    "connect/endpoints": f'["{endpoint}"]',
    # A router has a port of its own, whichever is free.
    "listen/endpoints": '["tcp/127.0.0.1:0"]',
    "scouting/multicast/enabled": "false",
    "transport/unicast/qos/enabled": "false" if low_latency == "yes" else "true",
    "transport/unicast/lowlatency": "true" if low_latency == "yes" else "false",
}.items():
    config.insert_json5(name, value)
with zenoh.open(config) as session:
    heard = session.declare_subscriber("causeway/*/world/*/frame")
    heard.recv()
    print("hears", flush=True)
    while True:
        time.sleep(0.01)
        while heard.try_recv() is not None:
            pass
