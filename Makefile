# make demo   lift the example clip to a VDB sequence in demo/sequence, with pictures from all sides and a video
# make test   formatting, types and tests; nothing that needs a GPU
# make stubs  types of the compiled core, after a change of what cpp/ offers to Python
# make sanitize       tests of the compiled core with one that checks itself for accesses outside arrays and the like
# make stability      damaged files and failing systems against the command line; CASES=300 of each kind take an hour
# make extension      the Blender extension's zips in dist/, with the manual; ENGINE_WHEELS=DIR adds platforms built elsewhere
# make cross-wheels   on Linux, the engine's wheels for Windows and macOS, and what they need of these systems
# make manual         the manual in build/manual/index.html; a link that leads nowhere fails
# make test-blender   those zips in the bpy wheels and, beside them, in a real Blender
# All set up what they need in .venv first. Only Python 3.11 to 3.13 and a C++17 compiler are assumed; those of the
# extension need Python 3.11 and 3.13 both, because Blender does.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
VENV := .venv
BIN := $(VENV)/bin
# Blender's openvdb module exists for Python 3.11 and 3.13, so these come first.
PYTHON ?= $(shell for p in python3.11 python3.13 python3.12 python3; do \
	"$$p" -c 'import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null \
	&& { echo "$$p"; break; }; done)
CXX_FOUND := $(shell command -v "$${CXX:-c++}" || command -v g++ || command -v clang++)
ENGINE_SOURCES := pyproject.toml CMakeLists.txt $(wildcard cpp/*) $(shell find engine -name '*.py' -o -name '*.pyi')
QUIET_PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check

# Of each kind: some four minutes for what runs with every change.
CASES ?= 20
# Files or folders that `make pytest` runs in place of all tests.
TESTS ?=
HAS_VDB = $(shell $(BIN)/python -c 'import importlib.util as u; print("yes" if u.find_spec("bpy") else "")')

# What a step that failed left behind is not taken for its result.
.DELETE_ON_ERROR:

.PHONY: demo test pytest lint stubs sanitize stability manual extension cross-wheels test-blender clean

demo: $(VENV)/engine.stamp
	rm -rf demo/sequence
	$(BIN)/smokelift reconstruct examples/plume/scene.toml --out demo/sequence $(if $(HAS_VDB),,--npz)
	$(BIN)/smokelift preview demo/sequence

test: lint pytest

pytest: $(VENV)/tools.stamp
	$(BIN)/python -m pytest -n 2 --dist worksteal $(TESTS)

sanitize: $(VENV)/tools.stamp
	$(BIN)/python tools/sanitize.py

stability: $(VENV)/tools.stamp
	rm -rf build/stability
	mkdir -p build
	$(BIN)/python -m benchmarks.stability build/stability --cases $(CASES)

lint: $(VENV)/tools.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/clang-format --dry-run --Werror cpp/*.cpp cpp/*.h
	$(BIN)/python tools/stubs.py --check
	$(BIN)/check-jsonschema --quiet --builtin-schema vendor.github-workflows .github/workflows/*.yml

stubs: $(VENV)/tools.stamp
	$(BIN)/python tools/stubs.py

$(VENV)/pip.stamp: pyproject.toml
	@[ -n "$(PYTHON)" ] || { echo "Smokelift needs Python 3.11, 3.12 or 3.13 with venv; install one, or say make PYTHON=/path/to/python3." >&2; exit 2; }
	@[ -n "$(CXX_FOUND)" ] || { echo "Smokelift needs a C++17 compiler; install g++ or clang++ (Debian: apt install g++)." >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(QUIET_PIP) --upgrade pip
	touch $@

# Installed as a wheel, not editable: what is tested is what is shipped, compiled once for both.
$(VENV)/engine.stamp: $(VENV)/pip.stamp tools/engine_wheels.py $(ENGINE_SOURCES)
	$(BIN)/python tools/engine_wheels.py --out $(VENV)/wheel
	$(QUIET_PIP) --force-reinstall --no-deps $(VENV)/wheel/*.whl
	$(QUIET_PIP) "$$(echo $(VENV)/wheel/*.whl)[vdb]"
	touch $@

# What only developers need, and the tests.
$(VENV)/tools.stamp: $(VENV)/engine.stamp
	$(QUIET_PIP) --group dev "$$(echo $(VENV)/wheel/*.whl)[gpu]"
	touch $@

# Besides its pages it holds what tools/ read from the code: commands, scene files, messages.
MANUAL_SOURCES := mkdocs.yml $(shell find docs examples tools addon -type f -not -name '*.pyc') $(wildcard *.md)

manual: build/manual/index.html

build/manual/index.html: $(VENV)/manual.stamp $(MANUAL_SOURCES)
	NO_MKDOCS_2_WARNING=true $(BIN)/mkdocs build --strict

$(VENV)/manual.stamp: $(VENV)/engine.stamp
	$(QUIET_PIP) --group docs
	touch $@

extension: dist/extension.stamp

dist/extension.stamp: build/engine-wheels/stamp build/manual/index.html tools/build_extension.py $(wildcard tools/extension_*.py tools/bundle*.txt) blender_manifest.toml LICENSE $(wildcard addon/*.py addon/*/*.py)
	$(BIN)/python tools/build_extension.py --engine-wheels build/engine-wheels $(ENGINE_WHEELS) --out dist
	touch $@

build/engine-wheels/stamp: $(VENV)/extension.stamp tools/engine_wheels.py $(ENGINE_SOURCES)
	$(BIN)/python tools/engine_wheels.py --blender --out build/engine-wheels
	touch $@

$(VENV)/extension.stamp: $(VENV)/engine.stamp
	$(QUIET_PIP) --group extension
	touch $@

cross-wheels: $(VENV)/cross.stamp
	$(BIN)/python tools/cross_wheels.py --out build/cross-wheels

$(VENV)/cross.stamp: $(VENV)/engine.stamp
	$(QUIET_PIP) --group cross
	touch $@

test-blender: dist/extension.stamp $(VENV)/tools.stamp
	$(BIN)/python -m pytest -n 2 --dist loadscope -v -rP --durations=0 --durations-min=1 \
		tests/blender/wheels.py tests/blender/debian.py

clean:
	rm -rf $(VENV) build dist demo
