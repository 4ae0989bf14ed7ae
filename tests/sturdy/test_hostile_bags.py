"""Damaged bags by the hundred: only the program's own errors, soon, within bounds of memory, and no file is left.

30 bags in the quick tier; 10,000 in the slow one, or as many as JAXIDENT_FUZZ_BAGS says.
"""

import os
import random
import resource
import shutil
import time
import warnings

import pytest
from support.bags import BEGIN, FORMATS, Bag, name_of

from jaxident.errors import InputError, WorkError
from jaxident.files.bag_topics import list_topics
from jaxident.files.bags import read_bag_streams
from jaxident.files.messages import Choice

pytest.importorskip("rosbags", reason="rosbags is not installed (extra ros)")

QUICK, SLOW = 30, int(os.environ.get("JAXIDENT_FUZZ_BAGS", "10000"))
LONGEST = 5.0
MOST_MEMORY = 1 << 20
"""Kilobytes by which the process may grow."""
TOKENS = (b"\0" * 8, b"\xff" * 8, b"\xff\xff\xff\x7f", b"../../x", b"!!python/object:os.system", b"9" * 40, b"\n", b"")


def small_bag(folder, form):
    """Twenty commands and poses."""
    path = name_of(folder, form)
    with Bag(path, form) as bag:
        for k in range(20):
            stamp = BEGIN + 50_000_000 * k
            bag.add("/cmd", stamp, bag.twist(0.1, 0.2))
            bag.add(
                "/pose", stamp, bag.make("geometry_msgs/PoseStamped", bag.header(stamp), bag.pose(0.1 * k, 0.0, 0.1))
            )
    return path


def mutated(content: bytes, chance: random.Random) -> bytes:
    """Cut short, bits flipped, a piece replaced by a token, taken out or doubled."""
    changed = bytearray(content)
    for _ in range(chance.randint(1, 4)):
        begin = chance.randrange(len(changed)) if changed else 0
        end = min(len(changed), begin + chance.choice([0, 1, 4, 8, 64, 512]))
        kind = chance.choice(["flip", "flip", "flip", "token", "double", "cut"])
        if kind == "flip" and changed:
            changed[begin] ^= 1 << chance.randrange(8)
        elif kind == "token":
            changed[begin:end] = chance.choice(TOKENS)
        elif kind == "double":
            changed[begin:end] = changed[begin:end] * 2
        elif kind == "cut" and chance.random() < 0.3:
            del changed[begin:]
    return bytes(changed)


def feed(path) -> bool:
    """Read a bag as `convert` does; whether it was refused."""
    try:
        list_topics(path)
        read_bag_streams(path, command_topic="/cmd", pose_topic="/pose", choice=Choice())
    except (InputError, WorkError):
        return True
    return False


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("total", [QUICK, pytest.param(SLOW, marks=pytest.mark.slow)])
def test_damaged_bags(total, tmp_path):
    whole = [small_bag(tmp_path, form) for form in FORMATS]
    assert not any(feed(path) for path in whole)
    memory, refused = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0
    for number in range(total):
        chance = random.Random(number)
        source = whole[number % len(FORMATS)]
        path = tmp_path / "damaged" / source.name
        shutil.rmtree(path.parent, ignore_errors=True)
        path.parent.mkdir()
        (shutil.copytree if source.is_dir() else shutil.copyfile)(source, path)
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        chosen = chance.choice(files)
        chosen.write_bytes(mutated(chosen.read_bytes(), chance))
        before = sorted(os.listdir(tmp_path))
        begin = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            refused += feed(path)
        assert time.process_time() - begin < LONGEST, number
        assert sorted(os.listdir(tmp_path)) == before
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory < MOST_MEMORY
    assert 0.2 * total < refused
