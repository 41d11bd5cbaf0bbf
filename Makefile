# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
# make demo, make test, make test-full, make test-hardware, make sanitize, make lint: each sets up what is missing first (setup.bash).
# make docs has an environment of its own, without ROS.

SHELL := /bin/bash
.DELETE_ON_ERROR:
.PHONY: help demo grasp test test-full test-hardware sanitize lint docs setup clean

# make demo SOURCE=file PATH_TO=press.avi OUT=out/press ...; anything else by ARGS="name:=value ..."
demo_arguments = $(if $(SOURCE),source:=$(SOURCE)) $(if $(PATH_TO),path:='$(PATH_TO)') $(if $(DEVICE),device:='$(DEVICE)') \
  $(if $(PARAMS),params:='$(PARAMS)') $(if $(CALIBRATION),calibration:='$(CALIBRATION)') $(if $(RVIZ),rviz:=$(RVIZ)) \
  $(if $(VIEW),view:=true) $(if $(TYPE),type:=$(TYPE)) $(if $(RECORD),record:='$(RECORD)') $(if $(OUT),out:='$(OUT)') $(ARGS)

# make test TESTS="test/style tactile_driver" PYTEST="-k name -x"
TESTS ?= $(wildcard tactile_*/test) test
run_tests = mkdir -p out && source ./setup.bash && python3 -m pytest $(TESTS) --junit-xml=out/test-results.xml

help:
	@echo 'make demo   a simulated touchpad is pressed: dots, contact region, numbers, pictures in out/'
	@echo '            make demo SOURCE=file PATH_TO=video.avi   the same on a recording, or on a file of a pressure array (.csv, .npz)'
	@echo '            make demo VIEW=1   the same in Rerun; installs it, an optional extra'
	@echo 'make grasp  a simulated gripper holds an object by the slip that its array reports; installs MuJoCo, an optional extra'
	@echo '            make grasp OBJECT=egg   another object; Ctrl-C ends it'
	@echo 'make test   the quick tests, and the demo; the report goes to out/test-results.xml'
	@echo '            make test TESTS=tactile_driver/test PYTEST="-k dots -x"   some of them'
	@echo 'make test-full   all tests but those that are marked slow'
	@echo 'make test-hardware   the drivers on cameras and serial adapters of a real kernel, in QEMU; the report goes to out/hardware.jsonl'
	@echo 'make sanitize  the tests of the compiled kernels, with checks of addresses and of undefined behaviour'
	@echo 'make lint   style and spelling alone'
	@echo 'make docs   the pages and the API reference as HTML, out/docs/index.html; a warning is an error'
	@echo 'make clean  takes away what make and setup.bash built, the environment included'

setup:
	@source ./setup.bash

demo:
	@source ./setup.bash && $(if $(VIEW),$(call extra,rerun) &&) ros2 launch tactile_bringup demo.launch.py $(demo_arguments)

# extra MODULE: the line of environment/extras.txt that provides it, installed where it is missing
extra = { python3 -c 'import $(1)' 2>/dev/null || { echo 'installing $(1), an optional extra' && python3 -m pip install --quiet \
  --disable-pip-version-check --requirement <(grep '^$(1)' environment/extras.txt); }; }

grasp:
	@source ./setup.bash && $(call extra,mujoco) && \
	  ros2 launch tactile_bringup grasp.launch.py demo:=true $(if $(OBJECT),object:=$(OBJECT))

# Two processes where pytest-xdist is installed; files stay whole.
test:
	@$(run_tests) $$(python3 -c 'import xdist' 2>/dev/null && echo '-n 2 --dist loadfile') -m 'not hardware and not slow and not full' $(PYTEST)

test-full:
	@$(run_tests) $(PYTEST)

test-hardware:
	@source ./setup.bash && python3 -m pytest test/hardware -m hardware -rs $(PYTEST)

# The kernels' tests are those of the folders that src/ has too, and of the border: most reach the kernels by Python's classes.
# Python itself leaks by design: leaks are not looked for.
# The limit of a test allows for checked code being much slower.
sanitize:
	@source ./setup.bash && cmake -S tactile_perception -B out/sanitize -DTACTILE_SANITIZE=ON -DBUILD_TESTING=OFF \
	  -DPython3_EXECUTABLE="$$(command -v python3)" -DCMAKE_INSTALL_PREFIX=$(CURDIR)/out/sanitize/install && \
	  cmake --build out/sanitize --target install --parallel 2
	@source ./setup.bash && ASAN_OPTIONS=detect_leaks=0 LD_PRELOAD="$$(g++ -print-file-name=libasan.so) $$(g++ -print-file-name=libubsan.so)" \
	  PYTHONPATH=$$(echo $(CURDIR)/out/sanitize/install/lib/python3*/*-packages):$$PYTHONPATH \
	  python3 -m pytest $(wildcard $(patsubst tactile_perception/src/%,tactile_perception/test/%,$(wildcard tactile_perception/src/*))) \
	  tactile_perception/test/core/test_border.py --timeout 1500 $(PYTEST)

lint:
	@source ./setup.bash && python3 -m pytest test/style $(PYTEST)

# Needs the network once, for docs/requirements.txt.
.env/docs/installed: docs/requirements.txt
	python3 -m venv .env/docs && .env/docs/bin/pip install --quiet --requirement $< && touch $@

docs: .env/docs/installed
	.env/docs/bin/sphinx-build --fresh-env --quiet --fail-on-warning --keep-going . out/docs
	.env/docs/bin/python docs/check_search.py out/docs

clean:
	rm -rf .env build install log out tactile_perception/tactile_perception/_core*
