"""What the installed module `overfly` must do: docstrings and pages as written, bad input by name.

In:    the installed module; `overfly` itself, if `--program` names it.
Out:   what was checked, exit code 1 if anything failed.
Keeps: nothing; recordings go to a folder that is thrown away.
Not here: the terrain's own tests.
"""

import argparse
import doctest
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time
import traceback

import numpy as np
import overfly

VIEW = overfly.View(10.0, 20.0, 400.0, size_px=(320, 240))


def docstrings():
    """Every public name, its methods and properties: (name, text)."""
    yield "overfly", overfly.__doc__
    for name in overfly.__all__:
        thing = getattr(overfly, name)
        yield name, thing.__doc__
        members = vars(thing).items() if isinstance(thing, type) else ()
        for member, value in members:
            if not member.startswith("_") and callable(value):
                yield f"{name}.{member}", value.__doc__


def examples_run(pages):
    """Examples in docstrings and pages; every public thing has a text."""
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    for name, text in docstrings():
        assert text and text.strip(), f"{name} has no docstring"
        runner.run(parser.get_doctest(text, {}, name, None, None))
    for page in pages:
        text = pathlib.Path(page).read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            old = os.getcwd()
            os.chdir(folder)
            try:
                # The closing fence is no output.
                text = text.replace("```", "")
                runner.run(parser.get_doctest(text, {}, page, page, 0))
            finally:
                os.chdir(old)
    failed, tried = runner.summarize()
    assert failed == 0 and tried > 20, f"{failed} of {tried} examples failed"
    print(f"   {tried} lines of examples")


def refuses(kind, part, call, *values, **named):
    """The call raises this, and says this."""
    try:
        call(*values, **named)
    except kind as error:
        assert part in str(error), f"`{error}` does not say `{part}`"
        return
    raise AssertionError(f"{call} took {values} {named}")


def bad_input_is_refused_by_name():
    terrain = overfly.Terrain("small")
    nan = float("nan")
    for kind, part, call, *values in [
        (
            ValueError,
            "lat_deg[1] is NaN, allowed is -90.0 to 90.0",
            terrain.heights,
            [0, nan],
            [0, 0],
        ),
        (ValueError, "lon_deg is inf", terrain.exact_heights, 0, float("inf")),
        (ValueError, "lat_deg has shape [2] and lon_deg [3]", terrain.heights, [0, 0], [0, 0, 0]),
        (ValueError, "lat_deg[1, 0] is 91", terrain.heights, [[0], [91]], [[0], [0]]),
        (ValueError, "query is `exact:57`", terrain.heights, 0, 0, "exact:57"),
        (ValueError, "query is `finest`", terrain.heights, 0, 0, "finest"),
        (ValueError, "ecef_m has shape [2]", terrain.agl, [1.0, 2.0]),
        (ValueError, "ecef_m[2] is NaN", terrain.agl, [1.0, 2.0, nan]),
        (ValueError, "direction is [0, 0, 0]", terrain.ray, [2000.0, 0, 0], [0, 0, 0]),
        (ValueError, "origin_m has shape [1, 3]", terrain.ray, [[2000.0, 0, 0]], [1, 0, 0]),
        (ValueError, "time is NaN s", terrain.frame, nan, [VIEW]),
        (ValueError, "radius_m is -1", terrain.request, 0, 0, -1.0, 20),
        (ValueError, "there is no ticket 7", terrain.release, 7),
        (ValueError, "lat_deg is -91", overfly.View, -91.0, 0, 0),
        (ValueError, "cannot read scene nowhere.ron", overfly.Terrain, "nowhere.ron"),
        (ValueError, "sauce", overfly.Terrain, "Scene(body: Wgs84, sauce: [])"),
        (ValueError, "neither a file nor a bundled flight", overfly.replay, "nowhere.ovf"),
        (
            ValueError,
            "frames is (5, 5)",
            lambda: overfly.replay("poles", frames=(5, 5), scene="small"),
        ),
        (ValueError, "every is 0", lambda: overfly.measure("poles", every=0)),
        (ValueError, "body is (0, 0)", lambda: overfly.ecef_from_geodetic(0, 0, 0, body=(0, 0))),
        (overfly.OverflyError, "no recording is open", terrain.finish_recording),
        (ValueError, "north", terrain.heights, "north", 0),
    ]:
        refuses(kind, part, call, *values)
    terrain.frame(0.0, [VIEW])
    refuses(overfly.OverflyError, "1 frames were run before", terrain.record, "late.ovf")
    refuses(TimeoutError, "pages are not there", terrain.wait_ready, 80.0, 0.0, 10.0, 30, 0.0)
    terrain.close()
    terrain.close()
    refuses(overfly.OverflyError, "the terrain is closed", terrain.frame, 0.0, [VIEW])
    refuses(overfly.OverflyError, "the terrain is closed", terrain.exact_heights, 0, 0)


def heights_have_shapes_and_agree():
    terrain = overfly.Terrain("small")
    lat, lon = np.meshgrid(np.linspace(-60, 60, 5), np.linspace(-170, 170, 7))
    exact = terrain.exact_heights(lat, lon, "exact:20")
    assert exact.height_m.shape == (7, 5) and (exact.status == overfly.Status.OK).all()
    alone = [
        float(terrain.exact_heights(a, o, "exact:20").height_m) for a, o in zip(lat.flat, lon.flat)
    ]
    assert alone == list(exact.height_m.flat), "one by one and together"
    assert terrain.exact_heights([], []).height_m.shape == (0,)
    assert terrain.exact_heights(np.float32(1), 2).height_m.shape == ()
    ticket = terrain.request(10.0, 20.0, 100.0, 24)
    terrain.wait_ready(10.0, 20.0, 100.0, 24)
    assert terrain.readiness(10.0, 20.0, 100.0, 24).fraction == 1.0
    resident = terrain.heights(10.0, 20.0, "exact:24")
    surveyed = terrain.exact_heights(10.0, 20.0, "exact:24")
    assert resident.height_m == surveyed.height_m and resident.bound_m == surveyed.bound_m
    point = overfly.ecef_from_geodetic(10.0, 20.0, 500.0, body=terrain.body)
    contact = terrain.agl(point, "exact:24")
    assert abs(contact.agl_m - (500.0 - resident.height_m)) < 1e-6
    assert contact.normal.shape == (3,) and abs(np.linalg.norm(contact.normal) - 1) < 1e-12
    assert terrain.agl(np.tile(point, (4, 1)), "exact:24").contact_m.shape == (4, 3)
    ray = terrain.ray(point, -point, 1e4, "exact:24")
    assert ray.status == overfly.Status.OK and abs(ray.distance_m - contact.agl_m) < 1.0
    assert terrain.ray(point, point, 1e4, "exact:24").distance_m is None
    terrain.release(ticket)
    back = overfly.geodetic_from_ecef(point, body=terrain.body)
    assert np.allclose([float(x) for x in back], [10.0, 20.0, 500.0], rtol=0, atol=1e-7)


def fly(path, workers=0, pages="waited"):
    """Forty frames, recorded; their digests."""
    with overfly.Terrain("small", workers=workers, pages=pages) as terrain:
        terrain.record(path, name="smoke")
        views = (
            overfly.View(10.0, 20.0 + i, 500.0 - 10 * i, size_px=(320, 240)) for i in range(40)
        )
        digests = [terrain.frame(i / 60, [view]).digest for i, view in enumerate(views)]
        assert terrain.finish_recording() == 40
    return digests


def recordings_replay_bit_for_bit():
    with tempfile.TemporaryDirectory() as folder:
        paths = [pathlib.Path(folder) / f"{i}.ovf" for i in range(3)]
        assert fly(paths[0]) == fly(paths[1], workers=2), "workers change nothing"
        assert paths[0].read_bytes() == paths[1].read_bytes()
        fly(paths[2], pages="as_ready")
        for path in paths:
            run = overfly.replay(path)
            assert run.same is True and run.diverged is None and run.damage is None
            assert run.digests.shape == (40, 4) and run.digests.dtype == np.uint64
            assert run.counts["leaves"].dtype == np.int64
        assert overfly.replay(paths[0]).counts["leaves"][-1] > 100
        assert overfly.replay(paths[0], frames=(10, 20)).same is None
        assert overfly.replay(paths[0], frames=(10, 20), from_start=True).same is True
        cut = paths[0].read_bytes()
        paths[2].write_bytes(cut[: len(cut) // 2])
        half = overfly.replay(paths[2])
        assert half.same is True and 0 < half.time_s.size < 40 and "2.ovf" in half.damage


def ctrl_c_ends_long_work():
    """Ctrl-C in the middle of a measured flight, which alone would take minutes."""
    main = threading.main_thread().ident
    threading.Timer(1.0, lambda: signal.pthread_kill(main, signal.SIGINT)).start()
    begin = time.monotonic()
    try:
        overfly.measure("rainier", scene="small", frames=(0, 30000), every=10, size_px=(320, 240))
    except KeyboardInterrupt:
        assert time.monotonic() - begin < 20.0
        return
    raise AssertionError("Ctrl-C was not heard")


def threads_share_a_terrain():
    """Others run while a frame does, and frames while heights are asked."""
    terrain = overfly.Terrain("small")
    ticket = terrain.request(10.0, 20.0, 100.0, 22)
    terrain.wait_ready(10.0, 20.0, 100.0, 22)
    alone = float(terrain.heights(10.0, 20.0, "exact:22").height_m)
    found = []

    def ask():
        found.extend(float(terrain.heights(10.0, 20.0, "exact:22").height_m) for _ in range(200))

    askers = [threading.Thread(target=ask) for _ in range(3)]
    for asker in askers:
        asker.start()
    for i in range(40):
        terrain.frame(i / 60, [overfly.View(10.0, 20.0 + i, 400.0)])
    for asker in askers:
        asker.join()
    assert found == [alone] * 600
    terrain.release(ticket)


def stills_are_pictures_or_say_why_not():
    view = overfly.View(20.0, 30.0, 1500.0, look_deg=(0.0, -90.0, 0.0), size_px=(160, 120))
    try:
        picture = overfly.still(view, scene="small")
    except overfly.OverflyError as error:
        assert "no picture: " in str(error)
        print(f"   skipped: {error}")
        return
    assert picture.shape == (120, 160, 4) and picture.dtype == np.uint8
    assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 20
    refuses(
        ValueError,
        "allowed is above the ground",
        overfly.still,
        overfly.View(0, 0, -900.0),
        scene="small",
    )


def the_program_finds_the_same(program):
    """`overfly replay` and `overfly measure --json` over the same frames."""
    if program is None:
        print("   skipped: no --program")
        return
    common = ["poles", "--scene", "small", "--frames", "60..64", "--size", "320x240"]
    named = {"scene": "small", "frames": (60, 64), "size_px": (320, 240)}
    done = subprocess.run(
        [program, "replay", *common, "--no-render"], capture_output=True, text=True
    )
    digest = overfly.replay("poles", **named).digest
    assert f"digest {digest} of 4 frames" in done.stdout, done.stdout + done.stderr
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "found.json")
        subprocess.run(
            [program, "measure", *common, "--rays", "2000", "--json", path],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        expected = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    found = overfly.measure("poles", rays=2000, **named)
    assert found == expected, [key for key in expected if found.get(key) != expected[key]]


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--program", help="the built `overfly`, to be held against")
    arguments.add_argument("--page", action="append", default=[], help="a page with examples")
    given = arguments.parse_args()
    checks = [
        (examples_run, [given.page]),
        (bad_input_is_refused_by_name, []),
        (heights_have_shapes_and_agree, []),
        (recordings_replay_bit_for_bit, []),
        (threads_share_a_terrain, []),
        (ctrl_c_ends_long_work, []),
        (stills_are_pictures_or_say_why_not, []),
        (the_program_finds_the_same, [given.program]),
    ]
    failed = 0
    for check, values in checks:
        begin = time.monotonic()
        print(check.__name__.replace("_", " "), flush=True)
        try:
            check(*values)
        except Exception:
            failed += 1
            print("   FAILED:", traceback.format_exc())
        print(f"   {time.monotonic() - begin:.1f} s")
    print(f"{len(checks) - failed} of {len(checks)} passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
