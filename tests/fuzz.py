"""Fuzzing by the million.

    python tests/fuzz.py interpreter --inputs 10000000
    python tests/fuzz.py renders --scenes 10000

The same inputs, fewer of them, are a part of the tests (test_fuzz.py).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parent.parent))

import fuzz_interpreter
import fuzz_renders
from tqdm import tqdm

_A_ROUND = 10_000  # examples of hypothesis, which remembers all that it has tried


def by_random(inputs: int, seed: int) -> int:
    """Inputs number 0, 1, 2, … of this seed: those that a failure names can be made again."""
    failures = 0
    with fuzz_interpreter.small_blocks():
        for number in tqdm(range(inputs), unit_scale=True, mininterval=5):
            text = fuzz_interpreter.text_of(Random(f"{seed}/{number}"))
            try:
                fuzz_interpreter.check(text)
            except Exception as error:
                failures += 1
                print(f"input {number}: {text!r}: {type(error).__name__}: {error}", flush=True)
    print(f"{inputs} inputs, seed {seed}: {failures} failures")
    return int(failures > 0)


def by_hypothesis(inputs: int, seed: int) -> int:
    """Inputs that hypothesis chooses; it makes those that fail as small as it can."""
    import hypothesis
    from hypothesis import strategies as st

    def check(random: Random) -> None:
        text = fuzz_interpreter.text_of(random)
        hypothesis.note(repr(text))
        fuzz_interpreter.check(text)

    few = hypothesis.settings(
        max_examples=_A_ROUND, deadline=None, database=None, suppress_health_check=list(hypothesis.HealthCheck)
    )
    with fuzz_interpreter.small_blocks():
        for number in tqdm(range(-(-inputs // _A_ROUND)), unit=" rounds"):
            hypothesis.seed(f"{seed}/{number}")(few(hypothesis.given(st.randoms(use_true_random=False))(check)))()
    print(f"{inputs} inputs, seed {seed}: no failure")
    return 0


def by_atheris(inputs: int, seed: int) -> int:
    """Inputs that reach lines of the interpreter that no other has reached. It ends the process."""
    import atheris

    for thing in vars(fuzz_interpreter.reader).values():
        if isinstance(thing, type(main)) and thing.__module__ == fuzz_interpreter.reader.__name__:
            atheris.instrument_func(thing)

    def mutated(data: bytes, longest: int, number: int) -> bytes:
        random = Random(number)
        if random.random() < 0.2:
            return fuzz_interpreter.text_of(random)[:longest]
        if random.random() < 0.5:
            return fuzz_interpreter.damaged(random, data)[:longest]
        return atheris.Mutate(data, longest)

    words = [sys.argv[0], f"-runs={inputs}", f"-seed={seed}", "-max_len=600", "-print_final_stats=1"]
    with fuzz_interpreter.small_blocks():
        atheris.Setup(words, lambda data: fuzz_interpreter.check(bytes(data)) and None, custom_mutator=mutated)
        atheris.Fuzz()
    return 0


def by_rendering(scenes: int, seed: int) -> int:
    """Scenes number 0, 1, 2, … of this seed, each drawn in every way."""
    failures = drawn = 0
    for number in tqdm(range(scenes), mininterval=5):
        try:
            drawn += fuzz_renders.drawn_alike(Random(f"{seed}/{number}"))
        except AssertionError as error:
            drawn, failures = drawn + 1, failures + 1
            print(f"scene {number}: {error}", flush=True)
    print(f"{scenes} scenes, {drawn} of them valid, seed {seed}: {failures} failures")
    return int(failures > 0)


ENGINES: dict[str, Callable[[int, int], int]] = {
    "random": by_random,
    "hypothesis": by_hypothesis,
    "atheris": by_atheris,
}


def main() -> int:
    """The exit status is 0 if nothing was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    targets = parser.add_subparsers(required=True, metavar="TARGET")
    texts = targets.add_parser("interpreter", help="scene files, right and wrong, for the interpreter")
    texts.add_argument("--inputs", type=int, default=100_000, metavar="N", help="how many, default 100000")
    texts.add_argument(
        "--engine", choices=ENGINES, default="random", help="who makes them; atheris: pip install atheris"
    )
    texts.set_defaults(run=lambda given: ENGINES[given.engine](given.inputs, given.seed))
    scenes = targets.add_parser("renders", help="valid scenes with extreme numbers, for everything that draws")
    scenes.add_argument("--scenes", type=int, default=1000, metavar="N", help="how many, default 1000")
    scenes.set_defaults(run=lambda given: by_rendering(given.scenes, given.seed))
    for target in (texts, scenes):
        target.add_argument("--seed", type=int, default=1, metavar="S", help="of what is random, default 1")
    given = parser.parse_args()
    return int(given.run(given))


if __name__ == "__main__":
    sys.exit(main())
