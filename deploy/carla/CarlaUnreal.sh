#!/bin/sh
# Starts a site in the place of a CARLA server, with CARLA's flags: for programs that start
# $CARLA_ROOT/CarlaUnreal.sh themselves. Wants `causeway` on the PATH, or its path in CAUSEWAY_BIN.
exec "${CAUSEWAY_BIN:-causeway}" CarlaUnreal-Linux-Shipping CarlaUnreal "$@"
