"""Goal: readers of OpenDRIVE that are not ours read every generated town, without a complaint.

They take a gigabyte and want an older numpy: `CAUSEWAY_READERS_DIR` names a virtual environment of
their own, into which `pip install scenic==3.1.1 asam-qc-opendrive==1.0.0 eclipse-sumo==1.28.0
pyxodr==0.1.3` has put them.
"""

import os
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from running_site import binary

NAMES = [f"Town0{number}" for number in range(1, 8)] + ["Town10HD"]

# Reads the map that its argument names, and prints how many roads and lanes it has.
SCENIC = """
import sys
from scenic.domains.driving.roads import Network

town = Network.fromFile(sys.argv[1], useCache=False, writeCache=False)
print(len(town.roads), len(town.lanes))
"""
PYXODR = """
import sys
from pyxodr.road_objects.network import RoadNetwork

roads = RoadNetwork(xodr_file_path=sys.argv[1]).get_roads()
lanes = [lane for road in roads for section in road.lane_sections for lane in section.lanes]
print(len(roads), sum(len(lane.boundary_line) > 1 for lane in lanes))
"""


@pytest.fixture(scope="module")
def readers() -> Path:
    """Where the readers' programs are."""
    if "CAUSEWAY_READERS_DIR" not in os.environ:
        pytest.skip("no readers of maps; set CAUSEWAY_READERS_DIR")
    return Path(os.environ["CAUSEWAY_READERS_DIR"]) / "bin"


@pytest.fixture(params=NAMES)
def town(request, tmp_path) -> Path:
    path = tmp_path / f"{request.param}.xodr"
    run(binary(), "map", "export", request.param, "-o", path)
    return path


def run(*command) -> str:
    finished = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert finished.returncode == 0, finished.stdout[-2000:] + finished.stderr[-2000:]
    return finished.stdout


@pytest.mark.parametrize("script", [SCENIC, PYXODR], ids=["scenic", "pyxodr"])
def test_libraries_read_a_town(script, readers, town):
    roads, lanes = map(int, run(readers / "python", "-c", script, town).splitlines()[-1].split())
    assert roads > 10
    assert lanes > 50


def test_asams_checker_finds_nothing(readers, town, tmp_path):
    found = tmp_path / "found.xqar"
    order = tmp_path / "order.xml"
    order.write_text(
        f'<Config><Param name="InputFile" value="{town}"/><CheckerBundle application="xodrBundle">'
        f'<Param name="resultFile" value="{found}"/></CheckerBundle></Config>'
    )
    run(readers / "qc_opendrive", "-c", order)
    result = ElementTree.parse(found)
    done = [one for one in result.iter("Checker") if one.get("status") == "completed"]
    assert len(done) >= 10
    assert [issue.get("description") for issue in result.iter("Issue")] == []


def test_sumo_makes_a_network_of_a_town(readers, town, tmp_path):
    network = tmp_path / "town.net.xml"
    run(readers / "netconvert", "--opendrive-files", town, "-o", network)
    edges = ElementTree.parse(network).findall("edge")
    assert sum(edge.get("function") != "internal" for edge in edges) > 20
