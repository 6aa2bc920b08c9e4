"""Plugins that change the process they run in: its hooks, limits, rounding, libraries, and the harness itself."""

import atexit
import builtins
import ctypes
import faulthandler
import fractions
import gc
import locale
import os
import random
import resource
import signal
import sys
import tempfile
import threading
import warnings
from contextlib import suppress
from typing import Any

import numpy as np
from hostile_kit import EITHER, LIKE_NTS, LONG, before, instead, wrongly

FE_UPWARD = 0x800  # The number in <fenv.h> on x86-64; another machine ignores it.
NOBODY = 65534


def _harness(*words: str) -> list[Any]:
    """Return the modules of the harness that are loaded here and whose name contains one of the words."""
    return [
        module
        for name, module in list(sys.modules.items())
        if name.startswith("contactverif") and any(word in name for word in words)
    ]


def _patch(modules: list[Any], name: str, value: Any) -> None:
    for module in modules:
        if hasattr(module, name):
            setattr(module, name, value)


success_at_exit = wrongly(
    lambda: atexit.register(os._exit, 0), "Answer wrongly, and turn the exit status into 0 when Python ends."
)


@wrongly
def success_by_hook() -> None:
    """Answer wrongly, and turn every error that nobody catches into the exit status 0."""
    sys.excepthook = lambda *_: os._exit(0)
    threading.excepthook = lambda *_: os._exit(0)


@wrongly
def success_by_exit() -> None:
    """Answer wrongly, and patch `sys.exit`."""
    sys.exit = lambda *_: os._exit(0)  # type: ignore[assignment]


@wrongly
def patched_run() -> None:
    """Answer wrongly, and patch the class that says whether promises are kept."""
    for module in _harness("contract.result"):
        module.Run.promises_kept = property(lambda run: True)
        module.Row.unexpected = property(lambda row: "")


@wrongly
def patched_judge() -> None:
    """Answer wrongly, and patch the function that judges a measurement."""
    (verdicts,) = _harness("contract.property")
    _patch(_harness(""), "judge", lambda *_: (verdicts.Verdict.PASS, ""))


patched_tolerances = wrongly(
    lambda: _patch(_harness(""), "UNIT_ROUNDOFF", 1e9),
    "Answer wrongly, and patch the unit roundoff that all tolerances are made of.",
)


@wrongly
def patched_oracle() -> None:
    """Answer wrongly, and patch the exact answers."""
    for module in _harness("oracle", "uniform_pressure"):
        for name, value in list(vars(module).items()):
            if callable(value) and not isinstance(value, type):
                setattr(module, name, lambda *_, **__: np.zeros(4))


@wrongly
def patched_fractions() -> None:
    """Answer wrongly, and patch the arithmetic of fractions, which the exact answers are made of."""
    fractions.Fraction.__mul__ = lambda a, b: fractions.Fraction(0)  # type: ignore[method-assign, assignment]
    fractions.Fraction.__sub__ = lambda a, b: fractions.Fraction(0)  # type: ignore[method-assign, assignment]


@wrongly
def patched_numpy() -> None:
    """Answer wrongly, and patch numpy's norms and comparisons."""
    np.linalg.norm = lambda *_, **__: 0.0  # type: ignore[assignment]
    np.isfinite = lambda values: np.ones(np.shape(values), bool)  # type: ignore[assignment]
    np.array_equal = lambda *_, **__: True  # type: ignore[assignment]


@wrongly
def patched_builtins() -> None:
    """Answer wrongly, and patch `max`, `abs` and `any`."""
    builtins.abs = lambda number: 0.0  # type: ignore[assignment]
    builtins.max = lambda *_, **__: 0.0  # type: ignore[assignment]
    builtins.any = lambda *_: False  # type: ignore[assignment]


@wrongly
def patched_writer() -> None:
    """Answer wrongly, and patch the functions that write a report."""
    _patch(_harness("write", "reports", "verify_command"), "write", lambda *_, **__: None)


@instead("residual", ends=EITHER)
def vandal(right: Any, *arguments: Any) -> Any:
    """Make VTS-PPT answer with twice its forces, by exchanging the class behind its factory."""
    import contactverif_nts.patch_test_passing as others

    for value in list(vars(others).values()):
        if isinstance(value, type) and "residual" in vars(value):
            residual = value.residual
            value.residual = lambda *some, residual=residual: 2 * residual(*some)
    return right()


@before("residual", ends=EITHER)
def trace() -> None:
    """Set a trace function that raises in every function of somebody else."""

    def complain(frame: Any, event: str, argument: Any) -> Any:
        if "hostile" not in frame.f_code.co_filename:
            raise RuntimeError("traced")

    sys.settrace(complain)
    threading.settrace(complain)


@before("residual", ends=EITHER)
def profile() -> None:
    """Set a profile function that ends the process when the harness writes its report."""

    def spy(frame: Any, event: str, argument: Any) -> None:
        if frame.f_code.co_name == "end_run":
            os._exit(0)

    sys.setprofile(spy)
    threading.setprofile(spy)


rounding_mode = before("residual", ends=EITHER)(
    lambda: ctypes.CDLL("libm.so.6").fesetround(FE_UPWARD), "Round upwards from now on."
)


@before("residual", ends=LIKE_NTS)
def no_garbage_collection() -> None:
    """Switch the garbage collection off, and freeze what is there."""
    gc.disable()
    gc.freeze()


@before("residual", ends=EITHER)
def exit_by_garbage_collection() -> None:
    """End the process with status 0 at the next garbage collection but 50."""
    runs: list[str] = []

    def count(phase: str, facts: Any) -> None:
        runs.append(phase)
        if len(runs) > 100:
            os._exit(0)

    gc.callbacks.append(count)


@before("residual", ends=LIKE_NTS)
def ignore_signals() -> None:
    """Ignore every signal that can be ignored, the end of a child too."""
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGCHLD, signal.SIGPIPE):
        signal.signal(number, signal.SIG_IGN)


alarm = before("residual", ends=EITHER)(
    lambda: signal.alarm(1), "Let the system send a signal in a second, whose default is to end the process."
)


@before("residual", ends=EITHER)
def timer() -> None:
    """Raise an exception in whatever code runs 50 ms later, again and again."""

    def complain(number: int, frame: Any) -> None:
        raise RuntimeError("time is over")

    signal.signal(signal.SIGALRM, complain)
    signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)


exit_later = before("residual", ends=EITHER)(
    lambda: faulthandler.dump_traceback_later(1.0, exit=True, file=sys.__stderr__),
    "Let Python's own watchdog end the process in a second.",
)


@before("residual", ends=EITHER)
def low_recursion_limit() -> None:
    """Allow hardly any recursion from now on."""
    with suppress(RecursionError):
        depth = len(list(_frames()))
        sys.setrecursionlimit(depth + 10)


def _frames() -> Any:
    frame = sys._getframe()
    while frame is not None:
        yield frame
        frame = frame.f_back  # type: ignore[assignment]


@before("residual", ends=LIKE_NTS)
def other_folder() -> None:
    """Change the working folder to one that is deleted afterwards."""
    folder = tempfile.mkdtemp(prefix="hostile-")
    os.chdir(folder)
    os.rmdir(folder)


@before("residual", ends=EITHER)
def other_root() -> None:
    """Make an empty folder the root of all files, which only the root user may do."""
    with suppress(OSError):
        folder = tempfile.mkdtemp(prefix="hostile-")
        os.chroot(folder)


@before("residual", ends=LIKE_NTS)
def other_user() -> None:
    """Become the user nobody, which only the root user may do."""
    with suppress(OSError):
        os.setgid(NOBODY)
        os.setuid(NOBODY)


no_environment = before("residual", ends=LIKE_NTS)(os.environ.clear, "Delete all environment variables.")
no_files = before("residual", ends=EITHER)(
    lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3)), "Forbid the process to open another file."
)
no_bytes = before("residual", ends=LIKE_NTS)(
    lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)), "Forbid the process to write to a file."
)


@before("residual", ends=EITHER)
def no_seconds() -> None:
    """Forbid the process to compute for more than what it has and a second."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    seconds = int(usage.ru_utime + usage.ru_stime) + 2
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))


no_memory = before("residual", ends=EITHER)(
    lambda: resource.setrlimit(resource.RLIMIT_AS, (2**20, 2**20)), "Forbid the process to take any more memory."
)


@before("residual", ends=LIKE_NTS)
def other_locale() -> None:
    """Change the language, and with it the decimal point of C."""
    for name in ("de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8", "C"):
        with suppress(locale.Error):
            locale.setlocale(locale.LC_ALL, name)
            return


@before("residual", ends=EITHER)
def warnings_as_errors() -> None:
    """Turn all warnings into errors, and let numpy raise for the smallest underflow."""
    warnings.simplefilter("error")
    np.seterr(all="raise")


@before("residual", ends=LIKE_NTS)
def no_paths() -> None:
    """Empty the list of folders that Python imports from."""
    sys.path.clear()
    sys.meta_path.clear()
    sys.path_importer_cache.clear()


@before("residual", ends=EITHER)
def no_modules() -> None:
    """Forget all modules of the harness and of numpy."""
    for name in list(sys.modules):
        if name.partition(".")[0] in ("contactverif", "contactverif_properties", "contactverif_reports", "numpy"):
            del sys.modules[name]


@before("residual", ends=LIKE_NTS)
def same_chance() -> None:
    """Seed the random numbers of everybody anew at each call."""
    random.seed(0)
    np.random.seed(0)  # noqa: NPY002


no_rights = before("residual", ends=LIKE_NTS)(
    lambda: os.umask(0o777), "Take all rights from files that are made from now on."
)
last_in_the_queue = before("residual", ends=LIKE_NTS)(lambda: os.nice(19), "Give the process the lowest priority.")


@before("residual", ends=EITHER)
def no_streams() -> None:
    """Replace the standard streams by objects that raise."""

    class Broken:
        def __getattr__(self, name: str) -> Any:
            raise RuntimeError("no stream")

    sys.stdout = sys.stderr = Broken()  # type: ignore[assignment]


seldom_switch = before("residual", ends=LIKE_NTS)(
    lambda: sys.setswitchinterval(LONG), "Let no other thread run for a long time."
)


@before("make", ends=EITHER)
def import_hook() -> None:
    """Answer every import from now on with an empty module."""

    class Finder:
        def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
            raise SystemExit(0)

    sys.meta_path.insert(0, Finder())  # type: ignore[arg-type]
