"""Long calls let the lock go, end at Ctrl-C, and divide their work. What must hold is shown by what waits
for what, not by a clock: a pipe that nobody has written to holds a call for as long as the test wants."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import numpy as np
import pytest
from conftest import FIXTURES, plain

import errsep

PROFILE = b"x,deviation\n0,0\n1,2\n2,0\n"

#: After so long a process that hangs is ended; nothing that works comes near.
PATIENCE = 120


def python(script: str, *arguments: str | Path) -> subprocess.Popen[str]:
    words = [sys.executable, "-c", textwrap.dedent(script), *map(str, arguments)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_two_calls_and_python_run_side_by_side(tmp_path: Path) -> None:
    """Two threads read pipes that the main thread writes to only when both are reading: with the lock
    held in either call nobody could."""
    pipes = [tmp_path / "one", tmp_path / "two"]
    for pipe in pipes:
        os.mkfifo(pipe)
    script = """
        import sys, threading
        import errsep

        answers = {}
        def call(pipe):
            answers[pipe] = errsep.straightness(pipe)["reference_lines"][2]["error"]["value"]

        threads = [threading.Thread(target=call, args=[pipe]) for pipe in sys.argv[1:]]
        for thread in threads:
            thread.start()
        # Opening waits until the call has opened the other end.
        ends = [open(pipe, "wb") for pipe in sys.argv[1:]]
        assert all(thread.is_alive() for thread in threads)
        for end in ends:
            end.write(b"x,deviation\\n0,0\\n1,2\\n2,0\\n")
            end.close()
        for thread in threads:
            thread.join()
        print(answers == {pipe: 2.0 for pipe in sys.argv[1:]})
    """
    process = python(script, *pipes)
    out, error = process.communicate(timeout=PATIENCE)
    assert (out, error, process.returncode) == ("True\n", "", 0)


def test_two_fits_run_side_by_side() -> None:
    """Each residual waits for the other fit's: both must be under way at once."""
    meeting = threading.Barrier(2, timeout=PATIENCE)
    found: dict[int, errsep.Fit] = {}
    met = threading.local()

    def fit(k: int) -> None:
        def residuals(p: np.ndarray) -> np.ndarray:
            if getattr(met, "times", 0) < 3:
                met.times = getattr(met, "times", 0) + 1
                meeting.wait()
            return np.array([10 * (p[1] - p[0] ** 2), 1 - p[0], p[0] - 1])

        found[k] = errsep.least_squares(residuals, [-1.2, 1.0])

    threads = [threading.Thread(target=fit, args=[k]) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    # A zero residual from differences: good to 1e-8 at least.
    assert [found[k].x == pytest.approx([1.0, 1.0], rel=1e-8) for k in range(2)] == [True, True]


def interrupted(process: subprocess.Popen[str]) -> str:
    """Sends Ctrl-C when the process has said that it is at work; returns what it said of it."""
    assert process.stdout is not None
    assert process.stdout.readline() == "at work\n"
    process.send_signal(signal.SIGINT)
    try:
        out, error = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode in (-signal.SIGINT, 128 + signal.SIGINT, 3), error
    return out + error


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
def test_ctrl_c_ends_a_command(tmp_path: Path) -> None:
    pipe = tmp_path / "never"
    os.mkfifo(pipe)
    script = """
        import os, sys, threading
        import errsep

        def say():
            # Opens when the call reads, and never writes.
            end = os.open(sys.argv[1], os.O_WRONLY)
            print("at work", flush=True)
            threading.Event().wait()

        # Signals wait while a report is put in place, and then are Python's again.
        errsep.straightness({"x": [0, 1], "deviation": [0, 1]}).report(sys.argv[1] + ".report")
        threading.Thread(target=say, daemon=True).start()
        try:
            errsep.straightness(sys.argv[1])
        except KeyboardInterrupt:
            print("interrupted", flush=True)
            raise
    """
    told = interrupted(python(script, pipe))
    assert "interrupted" in told and "KeyboardInterrupt" in told


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
@pytest.mark.parametrize("callback", ["None", "lambda state: None"])
def test_ctrl_c_ends_a_fit(callback: str) -> None:
    script = f"""
        import itertools, sys
        import errsep

        calls = itertools.count()
        def residuals(p):
            if next(calls) == 5:
                print("at work", flush=True)
            return [10 * (p[1] - p[0] ** 2), 1 - p[0]]

        while True:
            try:
                errsep.least_squares(residuals, [-1.2, 1.0], callback={callback})
            except KeyboardInterrupt:
                sys.exit(3)
    """
    interrupted(python(script))


#: Where a call is made in a thread that Python tells of no signal, and what the main thread does meanwhile.
IN_A_THREAD = """
    import os, signal, sys, threading
    import errsep

    ended, over, other, pressed = [], *(threading.Event() for _ in range(3))
    def work():
        try:
            {call}
        except KeyboardInterrupt:
            ended.append("the call")
        finally:
            over.set()

    threading.Thread(target=work, daemon=True).start()
    try:
        {wait}
    except KeyboardInterrupt:
        ended.append("the main thread")
    pressed.set()
    over.wait()
    print(sorted(ended), flush=True)
    sys.exit(3)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
@pytest.mark.parametrize("call", ["command", "fit"])
def test_ctrl_c_ends_a_call_from_another_thread(call: str, tmp_path: Path) -> None:
    pipe = tmp_path / "never"
    os.mkfifo(pipe)
    if call == "command":
        call = "errsep.straightness(sys.argv[1])"
        # Opens when the call reads, and never writes.
        wait = 'end = os.open(sys.argv[1], os.O_WRONLY); print("at work", flush=True); over.wait()'
    else:
        # The function answers when Ctrl-C has been pressed, in the midst of the fit.
        call = "errsep.least_squares(lambda p: [p[0], other.set() or pressed.wait()], [1.0])"
        wait = 'other.wait(); print("at work", flush=True); over.wait()'
    told = interrupted(python(IN_A_THREAD.format(call=call, wait=wait), pipe))
    assert told == "['the call', 'the main thread']\n"


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
def test_ctrl_c_ends_a_call_from_another_thread_of_asyncio(tmp_path: Path) -> None:
    pipe = tmp_path / "never"
    os.mkfifo(pipe)
    script = """
        import asyncio, os, sys, threading
        import errsep

        def say():
            end = os.open(sys.argv[1], os.O_WRONLY)
            print("at work", flush=True)
            threading.Event().wait()

        threading.Thread(target=say, daemon=True).start()
        try:
            asyncio.run(asyncio.to_thread(errsep.straightness, sys.argv[1]))
        except KeyboardInterrupt:
            print("interrupted", flush=True)
            sys.exit(3)
    """
    assert "interrupted" in interrupted(python(script, pipe))


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
def test_a_program_that_handles_ctrl_c_itself_keeps_its_calls(tmp_path: Path) -> None:
    pipe = tmp_path / "later"
    os.mkfifo(pipe)
    script = IN_A_THREAD.format(
        call='ended.append(str(errsep.straightness(sys.argv[1])["reference_lines"][2]["error"]["value"]))',
        wait="""signal.signal(signal.SIGINT, lambda *_: other.set())
        end = os.open(sys.argv[1], os.O_WRONLY)
        print("at work", flush=True)
        other.wait()
        # Longer than a call waits before it looks.
        over.wait(0.3)
        os.write(end, b"x,deviation\\n0,0\\n1,2\\n2,0\\n")
        os.close(end)""",
    )
    assert interrupted(python(script, pipe)) == "['2.0']\n"


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
@pytest.mark.parametrize("by", ["the command", "another program"])
def test_ctrl_c_ends_the_program(by: str, tmp_path: Path) -> None:
    pipe = tmp_path / "never"
    os.mkfifo(pipe)
    run = {
        "the command": "errsep.__main__.main()",
        "another program": "errsep._errsep.main(['errsep', *sys.argv[1:]])",
    }[by]
    script = f"""
        import os, sys, threading
        import errsep.__main__

        def say():
            end = os.open(sys.argv[2], os.O_WRONLY)
            print("at work", flush=True)
            threading.Event().wait()

        threading.Thread(target=say, daemon=True).start()
        try:
            {run}
        except KeyboardInterrupt:
            os._exit(3)
    """
    process = python(script, "straightness", pipe)
    interrupted(process)
    assert process.returncode == (-signal.SIGINT if by == "the command" else 3)


def test_one_thread_gives_the_same_answer_as_all() -> None:
    readings = FIXTURES / "reversal/readings.csv"
    answers = [
        plain(errsep.reversal(readings, simultaneous=True, diagnose=True, threads=n).to_dict())
        for n in (None, 1, 3)
    ]
    assert answers[0] == answers[1] == answers[2]


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="no list of threads")
def test_a_limit_that_limits_nothing_starts_no_more_threads_than_the_cores_can_use() -> None:
    script = """
        import os, threading, time, errsep
        most = 0
        def watch():
            global most
            while True:
                most = max(most, len(os.listdir("/proc/self/task")))
                time.sleep(0.001)
        threading.Thread(target=watch, daemon=True).start()
        data = errsep.simulate("reversal", seed=1, positions=31)["data"]
        errsep.reversal(data, simultaneous=True, threads=30000)
        errsep.batch({"id": ["a"], "command": ["straightness"], "data": ["nowhere.csv"]}, jobs=30000)
        print(most <= 40 + 17 * os.cpu_count(), most)
    """
    process = python(script)
    try:
        told = process.communicate(timeout=60)[0]
    finally:
        process.kill()
    assert told.startswith("True"), told


def diagnosed(seed: int) -> str:
    data = errsep.simulate("reversal", seed=seed, noise=0.05)["data"]
    return errsep.diagnose(data)["verdict"]["statement"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.parametrize("how", ["spawn", "fork"])
def test_processes_after_threads(how: str) -> None:
    """A forked process has not inherited the threads: it must not wait for them."""
    expected = [diagnosed(1), diagnosed(2)]
    context = multiprocessing.get_context(how)
    with context.Pool(2) as pool:
        assert pool.map_async(diagnosed, [1, 2]).get(PATIENCE) == expected


def test_many_calls_at_once_do_not_mix() -> None:
    """Each call has its own inputs under the same name."""
    from concurrent.futures import ThreadPoolExecutor

    def zone(height: int) -> float:
        profile = {"x": [0.0, 1.0, 2.0], "deviation": [0.0, float(height), 0.0]}
        return errsep.straightness(profile)["reference_lines"][2]["error"]["value"]

    heights = list(range(1, 65))
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(zone, heights)) == heights
