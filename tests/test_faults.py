"""Disks that are full, files that are no files, processes that are killed: nothing half written, no traceback."""

import errno
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from raytracer import SceneError, image, interpreter, load_png, save_png

ROOT = Path(__file__).parent.parent
SCENE = ROOT / "scenes" / "04_many_spheres.cli"
PICTURE = np.random.default_rng(1).integers(0, 256, (300, 300, 3), np.uint8)  # which no PNG makes much smaller
posix = pytest.mark.skipif(os.name != "posix", reason="there are no such files here")


def command(*words):
    return [sys.executable, "-m", "raytracer", *map(str, words)]


def render(out, size="64x64"):
    return command("render", SCENE, "-o", out, "--size", size)


# ----------------------------------------------------------------------------------------------- what is to be written


@posix
def test_a_process_killed_while_it_saves_leaves_the_old_picture(tmp_path):
    """The old file is whole; of the new one there is a draft at most, which a later save removes."""
    out = tmp_path / "out.png"
    save_png(out, PICTURE)
    program = (
        "import numpy as np; from raytracer import save_png; print(flush=True)\n"
        f"save_png({str(out)!r}, np.random.default_rng(2).integers(0, 256, (4000, 4000, 3), np.uint8))"
    )
    process = subprocess.Popen([sys.executable, "-c", program], cwd=ROOT, stdout=subprocess.PIPE)
    while process.poll() is None and not list(tmp_path.glob(".out.png.*.part.png")):
        time.sleep(0.001)
    process.kill()
    process.wait(20)
    process.stdout.close()
    np.testing.assert_array_equal(load_png(out), PICTURE)
    [draft] = tmp_path.glob(".*")
    save_png(out, PICTURE)
    assert draft.exists()  # it might still be written to
    os.utime(draft, (time.time() - 2 * image._STALE,) * 2)
    (tmp_path / ".other.png.0123456789abcdef.part.png").touch()
    os.utime(tmp_path / ".other.png.0123456789abcdef.part.png", (0, 0))
    save_png(out, PICTURE)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".other.png.0123456789abcdef.part.png", "out.png"]


@posix
def test_a_full_disk_leaves_the_old_picture(tmp_path):
    """As far as a process may write: the limit of a file's size gives the same error as a full disk, but its number."""
    out = tmp_path / "out.png"
    save_png(out, np.zeros((2, 2, 3), np.uint8))
    before = out.read_bytes()
    program = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        f"from raytracer.__main__ import main; sys.exit(main({list(map(str, render(out)[3:]))!r}))"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, f"{out}: {os.strerror(errno.EFBIG)}\n")
    assert out.read_bytes() == before
    assert list(tmp_path.iterdir()) == [out]


def test_a_full_device_leaves_the_old_picture(tmp_path, monkeypatch):
    out = tmp_path / "out.png"
    save_png(out, PICTURE)

    def full(file, picture):
        file.write(b"half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(image, "encode_png", full)
    with pytest.raises(OSError, match="No space left") as caught:
        save_png(out, PICTURE[::-1])
    assert caught.value.filename == str(out)
    np.testing.assert_array_equal(load_png(out), PICTURE)
    assert list(tmp_path.iterdir()) == [out]


@posix
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_may_not_be_written_to_is_told(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(PermissionError, match="may not be written"):
        save_png(tmp_path / "out.png", PICTURE)


# -------------------------------------------------------------------------------------------------- what is to be read


@posix
def test_what_is_no_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.cli")
    (tmp_path / "loop.cli").symlink_to("loop.cli")
    (tmp_path / "nowhere.cli").symlink_to("missing")
    (tmp_path / "folder.cli").mkdir()
    (tmp_path / "zero.cli").symlink_to("/dev/zero")
    for path in sorted(tmp_path.iterdir()):
        start = time.perf_counter()
        with pytest.raises(SceneError, match=r"\.cli: found no readable file, expected a scene \(.+\)"):
            interpreter(path)
        assert time.perf_counter() - start < 1, path


def test_a_file_that_is_being_written_is_read_as_far_as_it_is_there(tmp_path):
    """Any beginning of a file is a scene or a SceneError."""
    text, path = SCENE.read_bytes(), tmp_path / "half.cli"
    for length in range(0, len(text), 7):
        path.write_bytes(text[:length])
        with suppress(SceneError):
            interpreter(path)


# ------------------------------------------------------------------------------------------------------------- signals


@posix
def test_a_signal_while_a_string_is_executed_has_the_same_status(tmp_path):
    """As when a dataclass is made."""
    (tmp_path / "told.py").write_text(
        "import os, signal, sys\nfrom contextlib import suppress\nfrom raytracer import interrupts\n"
        "with suppress(KeyboardInterrupt), interrupts.noted():\n"
        "    exec('os.kill(os.getpid(), signal.SIGTERM)\\nwhile True: pass')\n"
        "sys.exit(interrupts.status())\n"
    )
    command = [sys.executable, "-m", "told"]
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (128 + signal.SIGTERM, b"")


@posix
@pytest.mark.parametrize(("number", "moments"), [(signal.SIGINT, 8), (signal.SIGTERM, 2)])
def test_a_signal_at_any_moment_ends_it_quietly(number, moments, tmp_path):
    """From the first line of the package on; before, Python itself is starting."""
    out = tmp_path / "out.png"
    for moment in range(moments):
        process = subprocess.Popen(render(out, "2500x2500"), cwd=ROOT, stderr=subprocess.PIPE, text=True)
        time.sleep(0.15 + 1.0 * moment / moments)
        process.send_signal(number)
        _, said = process.communicate(timeout=300)  # what comes while machine code is made may be answered after that
        if "runpy" not in said:
            assert "Traceback" not in said
            assert process.returncode in (0, 128 + number, -number), said  # −number: Python was not yet there
        assert not list(tmp_path.glob(".*"))


@posix
def test_a_reader_that_has_read_enough_is_no_fault():
    process = subprocess.Popen(command("explain", SCENE), cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait(30) == 141


@posix
def test_a_signal_where_nothing_can_be_raised_is_quiet_and_remembered():
    program = (
        "import os, signal\nfrom raytracer import interrupts\n"
        "class Dying:\n    def __del__(self):\n        os.kill(os.getpid(), signal.SIGTERM)\n        len('now')\n"
        "with interrupts.noted():\n    thing = Dying()\n    del thing\n    print(interrupts.came())\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("True\n", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_an_output_that_is_full_is_one_line():
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command("explain", SCENE), cwd=ROOT, stdout=full, stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr.count(b"\n"), b"No space" in done.stderr) == (1, 1, True)


def test_interrupted_work_leaves_threads_that_end():
    """Threads that nobody has told to end would be waited for, for ever, at the end of the process."""
    program = (
        "from raytracer import pool\n"
        "def work(job, worker):\n    raise KeyboardInterrupt\n"
        "try:\n    pool.share(list(range(9)), work, 2)\nexcept KeyboardInterrupt:\n    pass\n"
        "got = []\npool.share([1, 2, 3], lambda job, worker: job, 2, got.append)\nprint(sorted(got))"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, timeout=30, check=False)
    assert (done.stdout, done.stderr) == (b"[1, 2, 3]\n", b"")


@posix
@pytest.mark.parametrize("woken", [threading.main_thread, threading.current_thread], ids=["wakes", "does not wake"])
def test_what_interrupts_the_main_thread_leaves_the_compiler_alone(woken):
    """Compiling goes on in a thread of its own: in the main thread, locks would stay taken. And nobody waits for it.

    What comes in the moment before the main thread waits does not wake it, as little as what comes to another thread.
    """
    pytest.importorskip("numba")
    from raytracer.kernels.compiler import apart

    begun, go_on, ended = threading.Event(), threading.Event(), threading.Event()

    def compile_(signature):
        begun.set()
        assert go_on.wait(30)
        ended.set()

    def interrupt():
        assert begun.wait(30)
        time.sleep(0.2)  # until the main thread waits
        signal.pthread_kill(woken().ident, signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        apart(compile_)(())
    assert not ended.is_set()
    go_on.set()
    assert ended.wait(30)


@posix
def test_python_does_not_end_while_something_is_compiled():
    pytest.importorskip("numba")
    program = (
        "import os, signal, time\nfrom raytracer.kernels.compiler import apart\n"
        "def compile_(signature):\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n    time.sleep(0.3)\n    print('made', flush=True)\n"
        "try:\n    apart(compile_)(())\nexcept KeyboardInterrupt:\n    print('interrupted', flush=True)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("interrupted\nmade\n", "")


def test_what_goes_wrong_while_compiling_is_raised():
    pytest.importorskip("numba")
    from raytracer.kernels.compiler import compiled

    def nonsense(x):
        return x.there_is_no_such_thing

    with pytest.raises(Exception, match="there_is_no_such_thing"):
        compiled(nonsense)(1)


# --------------------------------------------------------------------------------------------- nowhere to keep anything


@posix
def test_no_home_and_no_name_is_no_fault(tmp_path):
    """A user without a home, whom the system does not know, in a place where nothing may be kept."""
    program = (
        "import os, pwd, pathlib\n"
        "from raytracer import machine_code\n"
        "def unknown(*_): raise KeyError('no such user')\n"
        "pwd.getpwuid = pwd.getpwnam = unknown\n"
        "machine_code._can_write = lambda place: False\n"
        "from raytracer import interpreter, render_scene\n"
        f"print(machine_code.folder(), render_scene(interpreter({str(SCENE)!r}), 'hit', 9, 9).shape)"
    )
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in ("HOME", "USER", "LOGNAME", "LNAME", "USERNAME")
    }
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, env=kept, check=False
    )
    assert (done.stdout, done.stderr) == ("None (9, 9, 3)\n", "")
