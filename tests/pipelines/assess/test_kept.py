"""Answers of long work survive its end, and only those to the same question are found."""

import dataclasses

import numpy as np
import pytest

from ground.errors import StorageError
from mechanics.limit.limit_load import Mechanism
from mechanics.limit.pushover import Pushover
from pipelines.assess import kept as kept_module
from pipelines.assess.answers import Answer
from pipelines.assess.diagnosis.trials import Tried
from pipelines.assess.kept import kept_answers
from pipelines.assess.motions import Motions

RECORDS = (Answer, Mechanism, Pushover, Tried, Motions)


def answers():
    mechanism = Mechanism(
        np.eye(2, 6), np.array([1.0, 0.1]), np.array([True, False]), np.zeros(2, dtype=bool)
    )
    way = np.array([0.0, 0.1 + 0.2])
    curve = Pushover("A", np.array([1.0, 0, 0]), way, way, way, 0.1, float("nan"), "it fell", 3, 0)
    told = {"name": "x", "bound": 0.1 + 0.2, "candidate": None, "stones": [{"code": "[A]"}], "pair": (1, 2)}
    yield Answer(told, mechanism, np.zeros((0, 3)), curve)
    yield Answer({}, mechanism, np.zeros((0, 3)))
    yield Tried(Motions({"A": np.arange(3.0)}, {"A": np.full((4, 3), 1 / 3)}), "", 0.5)
    yield Tried(None, "the run ended in collapse", 0.1)


def plain(value):
    """Contents with types and bits."""
    if dataclasses.is_dataclass(value):
        return type(value), {one.name: plain(getattr(value, one.name)) for one in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return value.dtype, value.shape, value.tobytes()
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    return repr(value)


def test_an_answer_is_revived_to_the_last_bit(tmp_path):
    with kept_answers(tmp_path / "out", "unfinished", RECORDS) as kept:
        for number, one in enumerate(answers()):
            kept.put(["scene", str(number)], one)
    with kept_answers(tmp_path / "out", "unfinished", RECORDS) as kept:
        assert len(kept) == 4
        for number, one in enumerate(answers()):
            assert plain(kept.get(["scene", str(number)])) == plain(one)


def test_an_answer_is_that_of_one_scene_and_one_version(tmp_path, monkeypatch):
    with kept_answers(tmp_path / "out", "unfinished", (Tried,)) as kept:
        kept.put(["scene", "question"], Tried(None, "", 0.0))
        assert kept.get(["scene", "question"]) is not None
        assert kept.get(["scene", "other"]) is None
        assert kept.get(["scenequestion"]) is None
    monkeypatch.setattr(kept_module, "versions", lambda: [("moma", "0.0.1")])
    with kept_answers(tmp_path / "out", "unfinished", (Tried,)) as kept:
        assert kept.get(["scene", "question"]) is None


def test_a_damaged_answer_is_found_again_and_nothing_is_left_of_no_answer(tmp_path):
    with kept_answers(tmp_path / "out", "unfinished", (Tried,)) as kept:
        kept.put(["scene"], Tried(None, "", 0.0))
        (path,) = (tmp_path / "out/unfinished").iterdir()
        path.write_text(path.read_text(encoding="utf-8")[:-9], encoding="utf-8")
        assert kept.get(["scene"]) is None
    with pytest.raises(KeyboardInterrupt), kept_answers(tmp_path / "other", "unfinished", ()):
        raise KeyboardInterrupt
    assert not (tmp_path / "other").exists()


def test_a_full_disk_ends_the_work_and_keeps_the_answers_before(tmp_path, monkeypatch):
    def full(path, content):
        raise OSError(28, "No space left on device")

    with kept_answers(tmp_path / "out", "unfinished", (Tried,)) as kept:
        kept.put(["first"], Tried(None, "", 0.0))
        monkeypatch.setattr(kept_module, "write_whole", full)
        with pytest.raises(StorageError, match=r"the disk is full; .* the same command goes on from there"):
            kept.put(["second"], Tried(None, "", 0.0))
        assert kept.get(["first"]) is not None
