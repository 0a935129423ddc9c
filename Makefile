# Batch pipeline and development tasks; `make help` lists them. GNU make 4.3 or newer, POSIX sh.

PYTHON ?= python3
VENV ?= .venv
LOGS = sample_data/*.csv sample_data/*.csv.gz sample_data/*.parquet
RANGES = $(if $(filter file,$(origin LOGS)),sample_data/range/range.toml)
OUT = out
FLAGS =
MODEL_FLAGS = --scenario family --flights 800 --seed 2021 --features motion
FUZZ = csv gzip parquet feather mat nc npz h5 json names truth trajectory station model header kernel
FUZZ_SECONDS = 600
OLDEST = tests/files tests/live/test_outputs.py tests/config tests/correction tests/test_pipeline.py tests/docs/test_readme.py
KERNELS ?= tests/core
JIT ?= $(KERNELS)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.SECONDEXPANSION:
.SUFFIXES:
MAKEFLAGS += --keep-going --no-builtin-rules

bin := $(VENV)/bin
ftproc := $(bin)/ftproc
installed := $(VENV)/.installed
developer := $(VENV)/.installed-dev
oldest := $(VENV)-oldest/.installed

# --- the logs ---------------------------------------------------------------------------------------------------

# Truths and trajectories are no logs, wherever they lie.
found := $(sort $(wildcard $(LOGS)))
logs := $(foreach log,$(found),$(if $(findstring .truth.,$(notdir $(log)))$(findstring .trajectory.,$(notdir $(log))),,$(log)))
stem = $(patsubst %.csv,%,$(patsubst %.parquet,%,$(patsubst %.csv.gz,%,$(notdir $(1)))))
output = $(OUT)/$(call stem,$(1)).trajectory.parquet
truth = $(firstword $(wildcard $(foreach kind,parquet csv csv.gz,$(dir $(1))$(call stem,$(1)).truth.$(kind))))
station = $(wildcard $(dir $(1))$(call stem,$(1)).toml)
$(foreach log,$(logs),$(eval log-of-$(call stem,$(log)) += $(log)))

outputs := $(foreach log,$(logs),$(call output,$(log)))
scored := $(foreach log,$(logs),$(if $(call truth,$(log)),$(log)))
# Flights that several stations have seen: DIR/range.toml becomes DIR.fused.parquet, DIR/truth.* is its truth.
fused = $(OUT)/$(notdir $(patsubst %/,%,$(dir $(1)))).fused.parquet
seen = $(firstword $(wildcard $(dir $(1))truth.parquet $(dir $(1))truth.csv))
ranges := $(wildcard $(RANGES))
$(foreach range,$(ranges),$(eval range-of-$(patsubst $(OUT)/%.fused.parquet,%,$(call fused,$(range))) := $(range)))
known := $(foreach range,$(ranges),$(if $(call seen,$(range)),$(range)))
# TRAJECTORY TRUTH LOG, a line for each that can be scored.
define scores
$(foreach log,$(scored),$(call output,$(log)) $(call truth,$(log)) $(log)
)$(foreach range,$(known),$(call fused,$(range)) $(call seen,$(range)) $(range)
)
endef

program := $(shell find ftproc -name '*.py' -o -name '*.safetensors')

ifneq ($(filter run,$(MAKECMDGOALS)),)
$(foreach pattern,$(LOGS),$(if $(wildcard $(pattern))$(filter file,$(origin LOGS)),,\
  $(error LOGS: there is no file $(pattern))))
$(foreach log,$(logs),$(if $(filter %.csv %.csv.gz %.parquet,$(log)),,\
  $(error LOGS: $(log) is not a .csv, .csv.gz or .parquet file)))
$(foreach log,$(logs),$(if $(word 2,$(log-of-$(call stem,$(log)))),\
  $(error LOGS: $(log-of-$(call stem,$(log))) would all become $(call output,$(log)); rename them)))
$(if $(logs),,$(error LOGS: there is no log among "$(LOGS)"))
endif

.PHONY: help run test kernels trust fuzz oldest audit samples model bench reproduce clean install wheel FORCE

help: ## this list
	@sed -n 's/^\([a-z]*\):.*## /make \1	/p' Makefile | expand -t 16
	@echo
	@echo 'make run LOGS="flights/*.csv" OUT=clean FLAGS="--smooth" filters your own logs; -j2 two at a time (--jobs).'
	@echo 'Only logs that changed are run again. A truth beside a log (STEM.truth.csv or .parquet) is used for the score,'
	@echo 'a station file beside it (STEM.toml) for reading it. RANGES="flight7/range.toml" fuses the logs of a range file.'

# One process filters all logs that are old: they would start slower than they are filtered. A log that fails stops
# neither the others nor the scores of what is there; a trajectory that is older than its log is not.
run: $(outputs) $(foreach range,$(ranges),$(call fused,$(range))) ## filter the LOGS to OUT with FLAGS, then print the score table
	$(file >$(OUT)/.scores,$(scores))
	@[ ! -e $(OUT)/.old ] || tr '\n' '\0' < $(OUT)/.old | \
	  xargs -0 $(ftproc) filter -o '$(OUT)/*.trajectory.parquet' --config '*.toml' --jobs $(jobs) --redo $(FLAGS) || \
	  : > $(OUT)/.failed
	@set --; while read -r trajectory truth log; do \
	  [ ! -e "$$trajectory" ] || [ "$$trajectory" -ot "$$log" ] || set -- "$$@" "$$trajectory" --truth "$$truth"; \
	  done < $(OUT)/.scores; echo; \
	  if [ $$# -gt 0 ]; then $(ftproc) score "$$@"; else echo 'There is no trajectory with a truth beside its log to score.'; fi
	@[ ! -e $(OUT)/.failed ]

# -j2 is two logs at a time, -j as many as there are processors.
jobs = $(or $(patsubst -j%,%,$(filter -j%,$(MAKEFLAGS))),$(if $(filter -j,$(MAKEFLAGS)),$$(nproc),1))

# The log is the first prerequisite. A change of the program, its model or FLAGS makes all results old.
$(OUT)/%.trajectory.parquet: $$(log-of-$$*) $$(call station,$$(log-of-$$*)) $(OUT)/.flags $(program) | $(installed)
	$(file >>$(OUT)/.old,$<)

$(OUT)/%.fused.parquet: $$(range-of-$$*) $$(wildcard $$(dir $$(range-of-$$*))*) $(OUT)/.flags $(program) | $(installed)
	@$(ftproc) filter --fuse $< -o $@ $(FLAGS) || : > $(OUT)/.failed

export FLAGS
$(OUT)/.flags: FORCE
	@mkdir -p $(@D)
	@rm -f $(OUT)/.old $(OUT)/.failed
	@printf '%s\n' "$$FLAGS" | cmp -s - $@ || printf '%s\n' "$$FLAGS" > $@

# --- the installation -------------------------------------------------------------------------------------------

# What takes long is said before it is done.
install: $(installed) ## make .venv and install ftproc in it

wheel: $(bin)/python ## dist/: a wheel for this system, its kernels compiled, and one for every other, which needs numba
	$(info building two wheels in dist/ (one to four minutes))
	@mkdir -p dist
	@$(bin)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .
	@FTPROC_ANYWHERE=1 $(bin)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .
	@ls dist

$(bin)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo 'ftproc needs Python 3.11 or newer: make PYTHON=/path/to/python3 ...' >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo '$(PYTHON) cannot make virtual environments: install python3-venv (apt-get install python3-venv).' >&2; exit 1; }
	$(info making $(VENV))
	@$(PYTHON) -m venv $(VENV)

# The kernels are compiled here, anew when one of them has changed.
$(installed): pyproject.toml hatch_build.py $(shell find ftproc/core -name '*.py') | $(bin)/python
	$(info installing ftproc in $(VENV), once: its libraries are fetched, then its kernels compiled (one to four minutes))
	@$(bin)/python -m pip install --quiet --disable-pip-version-check -e '.[geo,report]'
	@touch $@

$(developer): pyproject.toml | $(installed)
	$(info installing the developer tools in $(VENV), once (a minute))
	@$(bin)/python -m pip install --quiet --disable-pip-version-check -e '.[dev,geo,report]'
	@touch $@

# --- development ------------------------------------------------------------------------------------------------

test: $(developer) ## lint, types and the whole test suite
	$(bin)/ruff check .
	$(bin)/ruff format --check .
	$(bin)/mypy
	FTPROC_KERNELS=compiled $(bin)/python -m pytest -q -n logical --maxprocesses 8 --dist worksteal

kernels: $(developer) ## the tests JIT of the kernels as numba compiles them now, and KERNELS as plain Python
	FTPROC_KERNELS=jit $(bin)/python -m pytest -q -n logical --maxprocesses 8 --dist worksteal $(JIT)
	FTPROC_KERNELS=python $(bin)/python -m pytest -q -n logical --maxprocesses 8 --dist worksteal $(KERNELS)

samples: $(installed) ## make sample_data/ anew (fixed seeds: the same bytes)
	@mkdir -p sample_data/calibration
	$(ftproc) simulate --scenario zuo2021-outliers --seed 2021 \
	  -o sample_data/zuo2021-outliers.csv --truth sample_data/zuo2021-outliers.truth.csv
	$(ftproc) simulate --scenario manoeuvre --seed 7 --duration 75 \
	  --outliers isolated=0.03:6-300,offset=2:8-30:8-200,ramp=1:10-30:20-200,burst=1:8-20:10-100,nan=0.01,gap=1:2-4 \
	  -o sample_data/theodolite.parquet --truth sample_data/theodolite.truth.parquet
	$(ftproc) simulate --scenario radar --seed 11 \
	  --units range=km,azimuth=deg,elevation=deg --azimuth-from north \
	  -o sample_data/radar.csv --truth sample_data/radar.truth.csv
	$(ftproc) simulate --scenario calibration --seed 1 --duration 600 --dt 0.5 --instrument \
	  azimuth_zero_mrad=0.3,elevation_zero_mrad=-0.2,mislevel_mrad=0.6,mislevel_azimuth_rad=0.7,collimation_mrad=0.4,refraction=2.8e-4 \
	  -o sample_data/calibration/circle.parquet --truth sample_data/calibration/circle.truth.parquet
	$(ftproc) simulate --scenario range-radar --seed 7 --duration 60 \
	  -o sample_data/range --truth sample_data/range/truth.parquet
	rm -f sample_data/range/*.truth.csv sample_data/range/truth.biases.csv
	$(ftproc) simulate --scenario zuo2021-outliers --seed 5 --noise 0.02,0.00003,0.00003 --azimuth-from north \
	  --units azimuth=gon,elevation=gon -o - --truth sample_data/total_station.truth.csv | awk -F, 'BEGIN { OFS = "," } \
	  NR == 1 { print "t", "SD", "Hz", "V"; next } \
	  { hz = 37.25 - $$3; if (hz < 0) hz += 400; \
	    printf "%.3f,%.4f,%.5f,%.5f\n", $$1, $$2 + 0.0344, hz, 100 - $$4 + 0.003 }' > sample_data/total_station.csv

readme: $(developer) ## write the tables and outputs in the READMEs; BLOCKS="speed scale" or SLOW=1 for slow ones
	$(bin)/python -m tests.docs $(BLOCKS) $(if $(SLOW),--slow) $(if $(KEPT),--kept)

model: $(installed) ## train the packaged model anew (MODEL_FLAGS)
	$(ftproc) train $(MODEL_FLAGS) -o ftproc/correction/default.safetensors

trust: $(developer) ## the table of reliability: bad files, attacks, faults, long runs, fuzz, and slow tests (an hour)
	FTPROC_SLOW=1 $(bin)/python -m pytest -q -m slow
	$(bin)/python -m tests.trust

fuzz: $(developer) ## fuzz the readers and the filter (FUZZ) for FUZZ_SECONDS each; findings go to out/fuzz
	@$(bin)/python -m pip install --quiet --disable-pip-version-check -e '.[fuzz]'
	@found=0; for target in $(FUZZ); do echo "fuzzing $$target"; \
	  $(bin)/python -m tests.fuzz $$target $(FUZZ_SECONDS) || found=1; done; exit $$found

oldest: $(oldest) ## the tests OLDEST with the oldest versions that are supported (Python 3.11)
	NUMBA_CACHE_DIR=$(abspath $(VENV)-oldest/compiled) $(VENV)-oldest/bin/python -m pytest -q -n logical \
	  --maxprocesses 8 --dist worksteal -p no:cacheprovider $(OLDEST)

$(oldest): pyproject.toml tests/requirements-oldest.txt
	@echo 'installing the oldest supported versions in $(VENV)-oldest'
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || \
	  { echo 'The oldest versions need Python 3.11: make oldest PYTHON=/path/to/python3.11' >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV)-oldest
	@$(VENV)-oldest/bin/python -m pip install --quiet --disable-pip-version-check \
	  -c tests/requirements-oldest.txt -e '.[geo,formats,hdf5,report,wavelet]' \
	  pytest pytest-xdist hypothesis
	@touch $@

audit: $(developer) ## whether a vulnerability of one of the tested versions is known to PyPI
	@$(bin)/python -m pip install --quiet --disable-pip-version-check -e '.[audit]'
	@$(bin)/python -m tests.trust.audit

bench: $(developer) ## measure accuracy and speed
	$(bin)/python -m tests.bench

reproduce: $(developer) ## do the papers' experiments again: out/reproduce/reproduce.md
	$(bin)/python -m tests.acceptance.reproduce

clean: ## remove results and caches; the virtual environment stays
	rm -rf out build dist .pytest_cache .ruff_cache .mypy_cache .hypothesis ftproc/core/_kernels_*
	rm -f $(installed)
	find ftproc tests -name __pycache__ -type d -prune -exec rm -rf {} +
