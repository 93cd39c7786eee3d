PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
# compiled kernels, kept by their sources: all clones of the same source share them
export NUMBA_CACHE_DIR ?= $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/oilsim/kernels
# modules compiled once, where a container would have each of some hundred processes compile them: a tenth of the tests' work
unexport PYTHONDONTWRITEBYTECODE

# workers begin with halves of the tests, so that each file's fixtures are made, and each room's kernels loaded, by one of them
PYTEST := $(BIN)/pytest -n 2 --dist worksteal
# a mark for each state of the kernels' sources, when they have been compiled
KERNELS := $(NUMBA_CACHE_DIR)/compiled-$(shell grep -rl --include='*.py' njit oilsim coupling booms | sort | xargs cat | sha256sum | cut -c1-16)
QUICK := $(addprefix tests/,oilsim/density oilsim/gradients oilsim/neighborhood oilsim/pressure oilsim/viscosity oilsim/tension oilsim/sea oilsim/slick booms/losses coupling/master vessels scenarios/test_reference.py docs/test_pages.py test_readme.py)

.PHONY: demo conduct quick test test-all lint docs bench pareto validate stress fuzz mutants paper clean

demo: $(READY)  ## run the U-sweep exercise: recording, summary and picture
	$(BIN)/oilsim run u-sweep --demo --overwrite --record u-sweep.rrd --summary u-sweep.json --picture u-sweep.png

conduct: $(READY)  ## conduct an exercise on a page in the browser; EXERCISE=name or file
	$(BIN)/oilsim conduct $(or $(EXERCISE),sweep-200m)

quick: $(READY)  ## a choice of tests that takes under a minute with kernels compiled: while you work
	$(PYTEST) -q $(QUICK)

test: lint $(KERNELS)  ## lint, types, import layers, tests: what CI runs
	$(PYTEST)

test-all: lint $(KERNELS)  ## the same, with the tests that are marked slow
	$(PYTEST) -m 'slow or not slow'

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(READY)  ## write numbers and figures from the records of the validation, and build the documentation into site/index.html; every warning is an error
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo 'open site/index.html'

bench: $(READY)  ## measure the speed of core and exercises, keep it as this commit's record in docs/benchmarks, and print the tables of what they are made of
	$(BIN)/python -m tests.benchmarks.history
	$(BIN)/python -m tests.benchmarks.accuracy
	$(BIN)/python -m tests.benchmarks.calm_spread
	$(BIN)/python -m tests.benchmarks.recording
	$(BIN)/python -m tests.benchmarks.needless
	$(BIN)/python -m tests.benchmarks.checkpoints
	$(BIN)/python -m tests.benchmarks.kills

validate: $(READY)  ## run the cases of theory and experiment whose code has changed, and write the pages of their numbers; CASE=name[,name], BUDGET=2h
	$(BIN)/python -m tests.validation $(CASE) $(if $(BUDGET),--budget $(BUDGET))

pareto: $(READY)  ## run time against error, beside SPlisHSPlasH if installed: table, pareto-report/pareto.png and .json
	$(BIN)/python -m tests.benchmarks.pareto

stress: $(READY)  ## SCENES random scenes, EXCHANGES of them coupled otherwise, WORLDS pybullet worlds, held to what physics allows; scenes that fail are left in stress-report/
	$(BIN)/python -m tests.stress --scenes $(or $(SCENES),500) --exchanges $(or $(EXCHANGES),200) --worlds $(or $(WORLDS),100)

fuzz: $(READY)  ## SCENARIOS random scenario files, and EACH damaged meshes, FMUs, recordings, checkpoints, orders, signals, criteria, winds, resumed states, exports, sweeps, and ATTACKS on a console: all are refused in words or work
	$(BIN)/python -m tests.fuzz --scenarios $(or $(SCENARIOS),10000) $(foreach kind,meshes fmus recordings checkpoints orders signals criteria winds resumes exports sweeps,--$(kind) $(or $(EACH),1000))
	$(BIN)/python -m tests.fuzz.console --attacks $(or $(ATTACKS),2000)

mutants: $(READY)  ## put seeded faults into a copy of the code, EACH in each of FILES files, ONLY=oilsim,coupling; goes on where it was ended
	$(BIN)/python -m tests.mutants --files $(or $(FILES),40) --each $(or $(EACH),5) --seed $(or $(SEED),0) $(if $(ONLY),--only $(ONLY)) $(if $(NEAREST),--nearest $(NEAREST)) $(if $(SECONDS),--seconds $(SECONDS)) $(if $(RECORDED_RUNS),--recorded-runs)

PAPER := paper-calm,paper-wind,paper-rock,paper-timing
paper: $(READY)  ## run the figures of Qiu et al. 2021 again where their code has changed, test the paper's conclusions, and draw docs/pictures/validation/paper-*.png; some three minutes
	$(BIN)/python -m tests.validation $(PAPER) --levels 1; status=$$?; $(BIN)/python -m tests.validation.pages.report $(PAPER) && exit $$status

clean:
	rm -rf .venv build dist site *.egg-info

$(KERNELS): | $(READY)  # those of particles beside those of the sea, before the tests' workers each compile both
	@mkdir -p $(@D)
	$(BIN)/python -m tests.regression u-sweep paper-two-layer > /dev/null & $(BIN)/python -m tests.regression harbour-1km j-sweep-skimmer deploy-from-reel > /dev/null; wait
	@touch $@

$(READY): pyproject.toml
	@mkdir -p $(NUMBA_CACHE_DIR) && find $(NUMBA_CACHE_DIR) -type f -mtime +30 -delete  # of sources that are gone
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "oilsim needs Python 3.11 or newer; set PYTHON=..."; exit 1; }
	$(PYTHON) -m venv .venv
	@# uv takes a sixth of pip's time; where only pip's own configuration knows the index, pip does it
	$(BIN)/pip install --quiet 'uv>=0.9,<1' && $(BIN)/uv pip install --quiet --python $(BIN)/python --editable '.[dev]' || \
	  $(BIN)/pip install --quiet --editable '.[dev]'
	@echo 'compiling kernels, for a minute or two, so that the first exercise begins at once'
	@# those of particles beside those of the sea
	$(BIN)/oilsim run u-sweep --demo --until 1 --no-record > /dev/null & $(BIN)/oilsim run sweep-200m --until 1 --no-record && wait $$!
	$(BIN)/oilsim run sweep-200m --fidelity live --until 5 --no-record
	@touch $@
