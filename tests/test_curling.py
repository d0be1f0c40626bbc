"""The program handles an interrupt while it is still loading, and ignores it after the end."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import os, signal, sys

class Interrupting:
    def find_spec(self, name, *rest):
        if name == "curling_env.{module}":
            os.kill(os.getpid(), signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, Interrupting())
sys.argv[1:] = ["--version"]
import curling
status = curling.main()
os.kill(os.getpid(), signal.SIGINT)
sys.exit(status)
"""


def run(program: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )


def test_an_interrupt_while_loading_is_answered_in_one_line() -> None:
    done = run(PROGRAM.format(module="ice"))
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == (
        "curling: interrupted; nothing was written; repeat the command to start again\n"
    )


def test_an_interrupt_after_the_end_changes_nothing() -> None:
    done = run(PROGRAM.format(module="no_such_module"))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("curling-sheet ")
