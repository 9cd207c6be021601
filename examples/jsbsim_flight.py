"""A Cessna of JSBSim over overfly's ground: flown, recorded, replayed, plotted; or parked.

In:    `pip install overfly jsbsim`, and matplotlib for the plot; a scene.
Out:   flight.ovf, flight.csv and flight.png; exit code 1 where a replay differs or the gear jumps.
Keeps: nothing beside these files.
Not here: the flight model (JSBSim), the ground (overfly).

Two traps of JSBSim that this file goes around: the altitude hold of `c172x` holds the height above
the ground, whatever its comments say, so its set-point follows the ground; and JSBSim knows no
geoid, so that all heights here are above the ellipsoid.

    python jsbsim_flight.py --minutes 10 --again
    python jsbsim_flight.py --scene rainier.ron --parked
"""

import argparse
import csv
import math
import os
import pathlib
import re
import sys

os.environ.setdefault("JSBSIM_DEBUG", "0")

import jsbsim
import numpy as np
import overfly

FT = 0.3048
STEPS_HZ, FRAMES_HZ = 120, 60
"""The flight model's steps, and how often a frame is run: every second step."""
COLUMNS = ("time_s", "lat_deg", "lon_deg", "height_m", "ground_m", "bound_px", "digest")
"""Of the table of a flight."""
CLEARANCE_M = 600.0
"""Above the highest ground along the way."""
SETTLE_S = 10.0
"""How long a parked aircraft may sway on its gear."""
ORBIT_M, NEAR_M = 2e6, 2.0
"""How far above a parked aircraft the camera goes, and how near."""
CRAMPED_MIB = 16
"""Memory for pages while it stands."""
ASIDE_DEG = 10e3 / 111e3
"""To the north, where nobody requested the ground: 10 km."""


def cessna():
    """A C172 at the flight model's rate, quiet and with fixed noise."""
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    fdm.load_model("c172x")
    # The aircraft brings a table of its own, which would go into the current folder.
    fdm.set_output_filename(0, os.devnull)
    fdm.disable_output()
    fdm.set_dt(1 / STEPS_HZ)
    fdm["simulation/randomseed"] = 1
    return fdm


def place_at(fdm, lat_deg, lon_deg, ground_m, above_m):
    """Initial conditions over known ground."""
    fdm["ic/lat-geod-deg"], fdm["ic/long-gc-deg"] = lat_deg, lon_deg
    fdm["ic/terrain-elevation-ft"] = ground_m / FT
    fdm["ic/h-agl-ft"] = above_m / FT


def along(lat_deg, lon_deg, heading_deg, length_m, count=400):
    """Places of a straight way over a sphere: near enough to look for high ground."""
    share = np.linspace(0.0, length_m, count)[:, None] * [[1.0, 1.0]] / 6371e3
    north, east = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
    lats = lat_deg + np.degrees(share[:, 0] * north)
    return lats, lon_deg + np.degrees(share[:, 1] * east) / np.cos(np.radians(lats))


def eye_of(fdm):
    """What the pilot sees."""
    look = (fdm["attitude/psi-deg"], fdm["attitude/theta-deg"], fdm["attitude/phi-deg"])
    return overfly.View(
        fdm["position/lat-geod-deg"],
        fdm["position/long-gc-deg"],
        fdm["position/geod-alt-ft"] * FT,
        look_deg=look,
    )


def start(terrain, at, heading_deg, seconds):
    """The aircraft in the air with its autopilot on, and the height that it shall hold."""
    lat_deg, lon_deg = at
    speed_mps = 52.0
    highest_m = terrain.exact_heights(
        *along(lat_deg, lon_deg, heading_deg, seconds * speed_mps * 1.3), "within:50"
    ).height_m.max()
    hold_m = float(highest_m) + CLEARANCE_M
    ground_m = float(terrain.exact_heights(lat_deg, lon_deg).height_m)
    fdm = cessna()
    place_at(fdm, lat_deg, lon_deg, ground_m, hold_m - ground_m)
    fdm["ic/psi-true-deg"], fdm["ic/vc-kts"] = heading_deg, 90.0
    fdm.run_ic()
    fdm["propulsion/set-running"] = -1
    fdm["fcs/throttle-cmd-norm"], fdm["fcs/mixture-cmd-norm"] = 0.75, 0.8
    fdm["ap/heading_setpoint"], fdm["ap/heading_hold"] = heading_deg, 1
    fdm["ap/altitude_hold"] = 1
    return fdm, hold_m


def fly(arguments, path):
    """One flight, recorded; rows of time, place, height, ground and frame."""
    rows = []
    with overfly.Terrain(arguments.scene) as terrain:
        seconds = arguments.minutes * 60.0
        fdm, hold_m = start(terrain, arguments.at, arguments.heading, seconds)
        terrain.record(path, name="c172x", rate_hz=FRAMES_HZ)
        for step in range(round(seconds * STEPS_HZ)):
            lat_deg, lon_deg = fdm["position/lat-geod-deg"], fdm["position/long-gc-deg"]
            ground_m = float(terrain.exact_heights(lat_deg, lon_deg).height_m)
            fdm["position/terrain-elevation-asl-ft"] = ground_m / FT
            # The autopilot holds a height above the ground: this one is above the ellipsoid.
            fdm["ap/altitude_setpoint"] = (hold_m - ground_m) / FT
            if step % (STEPS_HZ // FRAMES_HZ) == 0:
                result = terrain.frame(step / STEPS_HZ, [eye_of(fdm)])
                height_m = fdm["position/geod-alt-ft"] * FT
                row = (step / STEPS_HZ, lat_deg, lon_deg, height_m, ground_m)
                rows.append((*row, result.bound_px, result.digest))
            if not fdm.run():
                sys.exit("JSBSim ended the flight")
        terrain.finish_recording()
    return rows


def plot(path, rows, title):
    """Altitude over ground, if matplotlib is there."""
    try:
        import matplotlib
    except ImportError:
        print("no plot: matplotlib is not installed (pip install matplotlib)")
        return
    matplotlib.use("Agg")
    from matplotlib import pyplot

    time_s, height_m, ground_m = (np.array([row[i] for row in rows]) for i in (0, 3, 4))
    figure, (above, below) = pyplot.subplots(
        2, sharex=True, figsize=(10, 6), height_ratios=(3, 1), layout="constrained"
    )
    above.fill_between(time_s, ground_m, ground_m.min() - 50.0, color="#b8a88a", label="ground")
    above.plot(time_s, height_m, color="#1f4e79", label="aircraft")
    above.set(title=title, ylabel="m above the ellipsoid", xlim=(time_s[0], time_s[-1]))
    room_m = 0.25 * (height_m.max() - ground_m.min())
    above.set_ylim(ground_m.min() - 50.0, height_m.max() + room_m)
    above.legend(loc="upper right")
    below.plot(time_s, height_m - ground_m, color="#333333")
    below.set(xlabel="s", ylabel="m above ground", ylim=(0, None))
    figure.savefig(path, dpi=100)
    pyplot.close(figure)
    print(f"wrote {path}")


def flight(arguments):
    """Flies, replays, writes; whether everything was the same."""
    out = pathlib.Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    path = out / "flight.ovf"
    rows = fly(arguments, path)
    heights, grounds = (np.array([row[i] for row in rows]) for i in (3, 4))
    agl = heights - grounds
    print(f"flown: {len(rows)} frames, {len(rows) / FRAMES_HZ / 60:.1f} minutes")
    for name, column in (("aircraft", heights), ("ground", grounds), ("above ground", agl)):
        print(f"{name}: {column.min():.0f} to {column.max():.0f} m")
    run = overfly.replay(path)
    same = run.same is True
    verdict = "the same" if same else "DIFFERENT"
    print(f"replayed: digest {run.digest} of {run.time_s.size} frames, {verdict}")
    if arguments.again:
        second = out / "flight-again.ovf"
        fly(arguments, second)
        equal = path.read_bytes() == second.read_bytes()
        print(f"flown again: {path.stat().st_size} bytes, {'the same' if equal else 'DIFFERENT'}")
        same = same and equal
    with open(out / "flight.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(rows)
    print(f"wrote {out / 'flight.csv'}")
    plot(out / "flight.png", rows, f"c172x over {pathlib.Path(arguments.scene).stem}")
    return same


def camera_above_m(time_s):
    """From orbit to 2 m in 20 s, up again, down again, by equal factors in equal times."""
    turn = time_s / 20.0 % 2.0
    down = turn if turn <= 1.0 else 2.0 - turn
    return ORBIT_M * (NEAR_M / ORBIT_M) ** down


def cramped(scene):
    """The scene with so little memory that pages must go for others to come."""
    with overfly.Terrain(scene) as terrain:
        return re.sub(r"pages_mib: \d+", f"pages_mib: {CRAMPED_MIB}", terrain.scene_text)


def parked(arguments):
    """An aircraft on its gear while the ground is refined and coarsened; whether it stood still."""
    lat_deg, lon_deg = arguments.at
    with overfly.Terrain(cramped(arguments.scene)) as terrain:
        exact = terrain.exact_heights(lat_deg, lon_deg)
        level, ground_m = int(exact.level), float(exact.height_m)
        terrain.request(lat_deg, lon_deg, 50.0, level)
        terrain.wait_ready(lat_deg, lon_deg, 50.0, level)
        query = f"exact:{level}"
        fdm = cessna()
        place_at(fdm, lat_deg, lon_deg, ground_m, 4.3 * FT)
        fdm.run_ic()
        for brake in ("left", "right", "center"):
            fdm[f"fcs/{brake}-brake-cmd-norm"] = 1.0
        worst, drawn, counts = 0.0, [], {"admitted": 0, "evicted": 0, "splits": 0, "merges": 0}
        for step in range(round(arguments.seconds * STEPS_HZ)):
            time_s = step / STEPS_HZ
            here = fdm["position/lat-geod-deg"], fdm["position/long-gc-deg"]
            if step % (STEPS_HZ // FRAMES_HZ) == 0:
                eye_m = ground_m + camera_above_m(time_s)
                view = overfly.View(lat_deg, lon_deg, eye_m, look_deg=(0.0, -90.0, 0.0))
                result = terrain.frame(time_s, [view])
                counts = {name: counts[name] + result.counts[name] for name in counts}
                drawn.append(float(terrain.heights(lat_deg + ASIDE_DEG, lon_deg).height_m))
            found = terrain.heights(*here, query)
            assert found.status == overfly.Status.OK, "requested ground stays"
            fdm["position/terrain-elevation-asl-ft"] = float(found.height_m) / FT
            if not fdm.run():
                sys.exit("JSBSim ended the run")
            if time_s >= SETTLE_S:
                worst = max(worst, abs(fdm["accelerations/Nz"] - 1.0))
    jumps = np.abs(np.diff(np.array(drawn)))
    print(f"parked for {arguments.seconds:.0f} s at {ground_m:.2f} m, level {level}")
    print("meanwhile:", ", ".join(f"{count} {name}" for name, count in counts.items()))
    print("10 km aside, unrequested, the height of the finest page there (query best) changed")
    print(f"{np.count_nonzero(jumps > 0)} times, by {np.nanmax(jumps):.1f} m at most")
    print(f"max |a_z/g - 1| after {SETTLE_S:.0f} s: {worst:.6f} (allowed 0.05)")
    return worst <= 0.05


def place(text):
    """LAT,LON in degrees."""
    lat_deg, lon_deg = (float(part) for part in text.split(","))
    return lat_deg, lon_deg


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default="earth", help="a preset or a scene file")
    parser.add_argument("--minutes", type=float, default=10.0, help="how long to fly")
    parser.add_argument("--out", default="out/jsbsim", help="folder for what is written")
    parser.add_argument("--at", type=place, default=(46.70, -121.90), metavar="LAT,LON")
    parser.add_argument("--heading", type=float, default=20.0, help="degrees")
    parser.add_argument("--again", action="store_true", help="flies twice and compares the bytes")
    parser.add_argument("--parked", action="store_true", help="stands instead of flying")
    parser.add_argument("--seconds", type=float, default=60.0, help="how long to stand")
    arguments = parser.parse_args()
    good = parked(arguments) if arguments.parked else flight(arguments)
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
