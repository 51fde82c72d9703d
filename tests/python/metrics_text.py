"""Takes the text of `show_recorder_file_info(name, True)` apart as scenario_runner's metrics do: by
single spaces and fixed words, in a fixed order, up to the first row of a frame it does not know."""

EVENTS = [" Create", " Destroy", " Collision", " Parenting"]
SECTIONS = [
    " Positions",
    " State traffic lights",
    " Vehicle animations",
    " Walker animations",
    " Vehicle light animations",
    " Scene light changes",
    " Dynamic actors",
    " Actor bounding boxes",
    " Actor trigger volumes",
    " Current platform time",
    " Physics Control",
    " Traffic Light time events",
]


def vector(words: list[str]) -> tuple[float, ...]:
    return tuple(float(word.strip("(),")) for word in words)


def parse(text: str) -> dict:
    """Map, date, frames and duration; actors with their attributes; states by frame and actor."""
    head, *frames, foot = text.split("Frame")
    lines = head.split("\n")
    info = {"map": lines[1][5:], "date": lines[2][6:], "actors": {}, "frames": []}
    count, duration = foot.split("\n")[:2]
    info["total_frames"], info["duration"] = int(count[3:]), float(duration[10:-8])
    for number, frame in enumerate(frames, 1):
        rows = frame.split("\n")
        words = rows[0].split(" ")
        assert int(words[1]) == number
        state = {"elapsed": float(words[3]), "actors": {}, "collisions": []}
        read_rows(rows[1:], info["actors"], state)
        info["frames"].append(state)
    return info


def read_rows(rows: list[str], actors: dict, state: dict) -> None:
    rows = iter([*rows, ""])
    row = next(rows)
    for event in EVENTS:
        while row.startswith(event):
            words = row.split(" ")
            row = next(rows)
            if event == " Create":
                actor = actors.setdefault(int(words[2][:-1]), {"type_id": words[3]})
                actor["location"] = vector(words[6:9])
                while row.startswith("  "):
                    name, value = row.split(" = ")
                    actor[name[2:]] = value
                    row = next(rows)
            elif event == " Collision":
                state["collisions"].append((int(words[5]), int(words[-1])))
            elif event == " Parenting":
                actors[int(words[2])]["parent"] = int(words[4])
    for section in SECTIONS:
        if not row.startswith(section):
            continue
        row = next(rows)
        while row.startswith("  "):
            words = row.split(" ")
            note(section, words, state["actors"])
            row = next(rows)
    # What comes now is not read.


def note(section: str, words: list[str], actors: dict) -> None:
    if section == " Positions":
        actors[int(words[3])] = {"location": vector(words[5:8]), "rotation": vector(words[9:12])}
    elif section == " State traffic lights":
        actors[int(words[3])] = {"state": int(words[5])}
    elif section == " Vehicle animations":
        actors[int(words[3])]["throttle"] = float(words[7])
    elif section == " Vehicle light animations":
        actors[int(words[3])]["lights"] = words[4:]
    elif section == " Dynamic actors":
        actors[int(words[3])]["velocity"] = vector(words[5:8])
