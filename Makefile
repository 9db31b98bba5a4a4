# Everything runs in .venv, which the first target that needs it sets up: with what
# handclean runs on ($(READY)), or also what it is developed with ($(WHOLE)), all in the
# versions of requirements-lock.txt. All it takes is make and a Python >= 3.11.
# Paths are relative, so the folder may have spaces in its name.

PYTHON ?= python3
RUN := .venv/bin/python
READY := .venv/ready
WHOLE := .venv/whole
PIP := $(RUN) -m pip install --quiet --disable-pip-version-check
FAST := not slow and not bench
PLAIN := $(wildcard tests/kernels tests/numerics tests/hand)
COMPILING := tests/kernels/test_machine_code.py

.DEFAULT_GOAL := help
.PHONY: help demo test check slow bench figures wheel samples data pictures configs format again

help: ## show this
	@echo "handclean: offline cleaner of optical hand motion capture"
	@echo
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' Makefile

test: check ## check, all fast tests compiled, and some again as plain Python
	$(RUN) -m handclean warm
	OPENBLAS_NUM_THREADS=1 $(RUN) -m pytest -n 2 -m "$(FAST)"
	OPENBLAS_NUM_THREADS=1 NUMBA_DISABLE_JIT=1 \
		$(RUN) -m pytest -m "$(FAST)" $(PLAIN) --ignore $(COMPILING)

check: $(WHOLE) ## formatting, lint, types
	$(RUN) -m ruff format --check .
	$(RUN) -m ruff check .
	$(RUN) -m mypy

slow: $(WHOLE) ## the tests that take minutes
	OPENBLAS_NUM_THREADS=1 $(RUN) -m pytest -n 2 -m slow

bench: $(WHOLE) ## time it; writes tests/bench/RESULTS.md
	$(RUN) tests/bench/run.py

figures: $(WHOLE) ## write README's figures from tests/bench/RESULTS.md
	$(RUN) tests/bench/figures.py

demo: $(READY) ## calibrate, clean and score the sample sessions
	$(RUN) -m handclean warm calibrate-hand clean
	@rm -rf demo_out
	@for rom in sample_sessions/*_rom.c3d; do \
		take=$${rom##*/}; subject=demo_out/$${take%%_*}.subject.h5; \
		$(RUN) -m handclean calibrate-hand markers "$$rom" \
			--marker-set maycock26 -o "$$subject" || exit; \
		for truth in sample_sessions/"$${take%%_*}"_*.truth.h5; do \
			take=$${truth##*/}; take=$${take%.truth.h5}; \
			$(RUN) -m handclean clean "sample_sessions/$$take.c3d" \
				-o "demo_out/$$take.h5" --subject "$$subject" || exit; \
			for known in "sample_sessions/$$take.labelled.c3d" "$$truth"; do \
				$(RUN) -m handclean compare -q "$$known" "demo_out/$$take.h5" || exit; \
			done; \
		done; \
	done

wheel: $(WHOLE) ## build dist/*.whl with machine code inside, for this Python
	rm -rf build/wheel
	$(RUN) -m pip wheel --quiet --no-deps --wheel-dir build/wheel .
	$(RUN) -m handclean.factory.wheel build/wheel/handclean-*.whl dist

samples: $(WHOLE) ## make sample_sessions/ anew
	$(RUN) -m handclean.factory.samples sample_sessions

data: $(WHOLE) ## make what ships in handclean/data/ anew
	$(RUN) -m handclean.factory.shipped handclean/data

pictures: $(WHOLE) ## draw the hands in handclean/data/pictures/ anew
	$(RUN) -m handclean.factory.hand_pictures handclean/data/pictures
	$(RUN) -m handclean.factory.scan_picture handclean/data/pictures/scan.png
	$(RUN) -m handclean.factory.layout_picture handclean/data/pictures/layouts.png
	@if [ -f "$$HANDCLEAN_DATA/webxr_hand/right.glb" ]; then \
		$(RUN) -m handclean.factory.rig_picture \
			"$$HANDCLEAN_DATA/webxr_hand/right.glb" handclean/data/pictures/webxr.png; \
	fi

configs: $(WHOLE) ## write configs/default.toml from the settings classes
	mkdir -p configs
	$(RUN) -m handclean.cli.tables configs/default.toml

format: $(WHOLE) ## format the code
	$(RUN) -m ruff format .
	$(RUN) -m ruff check --fix .

# A virtual environment does not survive its folder being moved or renamed.
ifneq ($(shell cat $(READY) 2>/dev/null),$(shell pwd))
$(READY): again
endif

# pip would compile on one core, and the tests of all packages, too: compileall does not.
$(READY): requirements-lock.txt pyproject.toml
	@for python in "$(PYTHON)" python3 python3.13 python3.12 python3.11 none; do \
		if [ "$$python" = none ]; then \
			echo "handclean needs Python 3.11 or newer and found none;" \
				"make PYTHON=/path/to/python3 names one" >&2; \
			exit 1; \
		fi; \
		"$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
			2>/dev/null && break; \
	done; \
	echo "setting up .venv with $$("$$python" --version), which takes a minute"; \
	rm -rf .venv && "$$python" -m venv .venv || { \
		rm -rf .venv; \
		echo "$$python cannot make a virtual environment;" \
			"on Debian and Ubuntu: apt install python3-venv" >&2; \
		exit 1; \
	}
	@$(PIP) --constraint requirements-lock.txt --no-compile setuptools
	@$(PIP) --constraint requirements-lock.txt --no-compile \
		--no-build-isolation --editable .
	@$(RUN) -m compileall -qq -j 0 -x '/tests?/' .venv/lib || true
	@pwd > $(READY)

$(WHOLE): $(READY)
	@echo "adding to .venv what handclean is developed with"
	@$(PIP) --requirement requirements-lock.txt
	@touch $(WHOLE)
