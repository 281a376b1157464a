"""Pictures where PyVista is absent or cannot load: the process that draws says what is missing."""

import sys

import pytest

from pipelines.draw.offscreen.jobs import run_job


@pytest.mark.parametrize("state", ["absent", "unloadable"])
def test_the_process_that_draws_names_what_is_missing(state, monkeypatch, capsys, tmp_path):
    if state == "absent":
        monkeypatch.setitem(sys.modules, "pyvista", None)
    else:
        monkeypatch.delitem(sys.modules, "pyvista", raising=False)
        (tmp_path / "pyvista.py").write_text("raise ImportError('libGL.so.1: not there')", encoding="utf-8")
        monkeypatch.syspath_prepend(str(tmp_path))
    assert run_job(object, lambda *_: None) == 3
    assert ("pyvista" if state == "absent" else "libGL.so.1") in capsys.readouterr().out
