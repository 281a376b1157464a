# make demo   from a survey file to a picture of the stresses, in out/window
# make test   the tests, but those of over 0.7 s
# make tower  a synthetic storey of 2,508 stones with a core, from its survey to a report, in out/tower
# make site   these pages as a site, in out/site
# make clean  remove .venv and out
#
# Another interpreter: make demo PYTHON=python3.12

PYTHON ?= python3
VENV := .venv
MOMA := $(VENV)/bin/moma
# Almost half of pip's work is to compile 5,900 files to byte code; Python does so for those that it imports, where it may
# write them.
PIP := $(VENV)/bin/python -m pip install --quiet --disable-pip-version-check \
  $(if $(PYTHONDONTWRITEBYTECODE),,--no-compile)
SAMPLE := data/samples/window
OUT := out
KERNELS := $(shell find survey mechanics benchmarks -path "*/_kernels*" -name "*.py")

.DEFAULT_GOAL := help
.PHONY: help demo test tower site clean

help:
	@sed -n 's/^# \{0,1\}//p' Makefile | head -7

demo: $(VENV)/.kernels $(VENV)/.installed
	@mkdir -p $(OUT)
	@rm -f $(OUT)/window.db $(OUT)/window.db-wal $(OUT)/window.db-shm
	$(MOMA) ingest $(SAMPLE)/window.moma --db sqlite:///$(OUT)/window.db
	$(MOMA) run $(SAMPLE)/window.toml --db sqlite:///$(OUT)/window.db --out $(OUT)/window
	@echo
	@if test -f $(OUT)/window/von_mises.png; then echo "The picture: $(OUT)/window/von_mises.png"; \
	  else echo "No picture could be drawn on this machine; the warning above says what to install."; fi
	@echo "The report:  $(OUT)/window/report.html"

tower: $(VENV)/.kernels $(VENV)/.installed
	@rm -rf $(OUT)/tower
	$(MOMA) sample tower --out $(OUT)/tower
	$(MOMA) ingest $(OUT)/tower/tower.moma --db sqlite:///$(OUT)/tower/tower.db
	$(MOMA) ingest $(OUT)/tower/solids.obj --format solids --header $(OUT)/tower/head.moma --db sqlite:///$(OUT)/tower/tower.db
	$(MOMA) record $(OUT)/tower/knowledge.toml --db sqlite:///$(OUT)/tower/tower.db
	$(MOMA) propose infill --record --db sqlite:///$(OUT)/tower/tower.db > $(OUT)/tower/core.txt
	$(MOMA) run $(OUT)/tower/tower.toml --db sqlite:///$(OUT)/tower/tower.db --out $(OUT)/tower/results
	@echo
	@echo "The report:  $(OUT)/tower/results/report.html"

test: $(VENV)/.tests $(VENV)/.kernels
	$(VENV)/bin/python -m pytest

site: $(VENV)/.docs $(VENV)/.kernels
	$(VENV)/bin/python -m sphinx --fail-on-warning --keep-going --jobs auto docs $(OUT)/site
	@echo "The site:    $(OUT)/site/index.html"

# A mark is newer than pyproject.toml as long as what it stands for is installed. What compiles kernels comes first, so
# that the rest is installed while a second process compiles.
$(VENV)/.installed: pyproject.toml | $(VENV)/.kernels
	@echo "Installing into $(VENV); the first time this takes a minute or two."
	@$(PIP) numba scipy
	@$(VENV)/bin/python -m ground.kernels & compiler=$$!; trap "kill $$compiler; exit 130" INT TERM; \
	  $(PIP) --editable .; failed=$$?; kill $$compiler 2>/dev/null; wait $$compiler 2>/dev/null; exit $$failed
	@touch $@

$(VENV)/.tests: pyproject.toml | $(VENV)/bin/python
	@echo "Installing into $(VENV) with what the tests need; the first time this takes some minutes."
	@$(PIP) --editable '.[test]'
	@touch $@ $(VENV)/.installed

$(VENV)/.docs: pyproject.toml | $(VENV)/.installed
	@$(PIP) --editable '.[docs]'
	@touch $@

# numba keeps compiled kernels, and does not see that one in another file which they call has changed.
$(VENV)/.kernels: $(KERNELS) | $(VENV)/bin/python
	@find survey mechanics benchmarks -name '*.nb[ic]' -delete
	@touch $@

$(VENV)/bin/python:
	@command -v $(PYTHON) >/dev/null || { echo "make: there is no $(PYTHON):" \
	  "install Python 3.11 or later, or name yours, e.g. make demo PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "make: $$($(PYTHON) --version) is too old:" \
	  "MOMA needs 3.11 or later, e.g. make demo PYTHON=python3.12" >&2; exit 1; }
	@rm -rf $(VENV)
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); echo "make: no virtual environment could be made:" \
	  "on Debian and Ubuntu, apt-get install python3-venv" >&2; exit 1; }

clean:
	rm -rf $(VENV) $(OUT)
