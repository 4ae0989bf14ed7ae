"""One call that sets JAX up for estimation: double precision, fewer kernels, memory and compiled programs kept."""

import ctypes
import os
import pathlib

import jax

FLAGS = {
    "xla_backend_extra_options": "xla_cpu_use_multi_output_fusion",
    "xla_gpu_autotune_level": "0",
}
"""What XLA is asked for, unless XLA_FLAGS says something else of it; `start_jax` says why."""

SHORTEST_COMPILATION = 0.03
"""Seconds of compilation from which on code is kept: about what reading it takes. No other number was tried but 0.2, of
which `identify` compiled ten small programs anew, 0.4 s in all."""
TRIM_THRESHOLD, TOP_PAD, MMAP_THRESHOLD = -1, -2, -3
KEPT_MEMORY = {MMAP_THRESHOLD: 32 << 20, TRIM_THRESHOLD: 256 << 20, TOP_PAD: 64 << 20}
"""Names and values of glibc's mallopt(3) [bytes]: the largest threshold that every version takes, and one heap of a
thread, which is given back when it is empty unless the padding is as large."""


def start_jax(*, cache: bool = True) -> None:
    """Set up JAX for this process; the program calls it, and so should a script or notebook before its first array.

    * Double precision.
    * On a CPU, one kernel may give several results. Without this XLA computes what two results share once for each:
      the recursion, whose 70 carried numbers share nearly everything, takes three times longer.
    * On a graphics card, kernels are not tried in several variants: compiling a whole trial takes 18 s and not 120 s,
      and runs 7 % longer (`experiments/gpu.md`).
    * Both go into XLA_FLAGS, which XLA reads once, at the first computation; called later, they have no effect.
    * Under glibc, up to 256 MB of freed memory stay with the process. Without this every array above some megabytes is
      fetched from the system page by page and given back: a third of the time of a simulation of many trials.
    * With `cache`, compiled code and traced programs (`programs`) are kept between runs in the user's cache folder;
      JAXIDENT_CACHE moves it, set but empty turns it off.
    """
    jax.config.update("jax_enable_x64", True)
    flags = os.environ.get("XLA_FLAGS", "")
    added = [f"--{name}={value}" for name, value in FLAGS.items() if name not in flags]
    os.environ["XLA_FLAGS"] = " ".join([flags, *added]).strip()
    _keep_memory()
    folder = _cache_folder() if cache else ""
    if folder and _usable(folder):
        jax.config.update("jax_compilation_cache_dir", folder)
        jax.config.update("jax_persistent_cache_min_compile_time_secs", SHORTEST_COMPILATION)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", 0)


def _keep_memory() -> None:
    try:
        set_option = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return  # another C library than glibc
    for option, size in KEPT_MEMORY.items():
        set_option(option, size)


def _cache_folder() -> str:
    folder = os.environ.get("JAXIDENT_CACHE")
    if folder is not None:
        return folder
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return os.path.join(home, "jaxident")


def _usable(folder: str) -> bool:
    try:
        pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)
