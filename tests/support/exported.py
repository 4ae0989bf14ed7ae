"""Exported programs run: Python in this process, C by the compiler of the machine."""

import shutil
import subprocess

import numpy as np
import pytest

MAIN = """
#include <stdio.h>
#include "robot.h"
int main(void)
{
    struct robot robot;
    double u_r, u_l, pose[3];
    robot_init(&robot);
    while (scanf("%lf %lf", &u_r, &u_l) == 2) {
        STEP
        printf("%.17g %.17g %.17g\\n", pose[0], pose[1], pose[2]);
    }
    return 0;
}
"""
PHYSICAL = "if (robot_step(&robot, u_r, u_l, ROBOT_PERIOD)) { return 1; }\n        robot_seen(&robot, pose);"
DIFFERENCE = "robot_step(&robot, u_r, u_l); pose[0] = robot.x; pose[1] = robot.y; pose[2] = robot.theta;"
STRICT = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic")


def program(text: str) -> dict:
    """The names of an exported Python program."""
    names: dict = {}
    exec(compile(text, "robot.py", "exec"), names)
    return names


def python_poses(text: str, u: np.ndarray) -> np.ndarray:
    """Poses (rows, 3) after each row of commands (rows, 2)."""
    robot = program(text)["Robot"]()
    return np.array([robot.step(*row) for row in u.tolist()])


def c_poses(text: str, u: np.ndarray, folder, step: str = PHYSICAL) -> np.ndarray:
    """The same by the C header, compiled without a warning; the test is skipped where there is no compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    (folder / "robot.h").write_text(text)
    (folder / "main.c").write_text(MAIN.replace("STEP", step))
    subprocess.run([compiler, *STRICT, "main.c", "-lm", "-o", "main"], cwd=folder, check=True, timeout=120)
    rows = "\n".join(f"{a!r} {b!r}" for a, b in u.tolist())
    shown = subprocess.run(["./main"], cwd=folder, input=rows, capture_output=True, text=True, check=True, timeout=60)
    return np.array([[float(cell) for cell in line.split()] for line in shown.stdout.splitlines()])
