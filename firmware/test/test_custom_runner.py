"""How `pio test` builds and runs our unit tests. They are written with doctest, whose header is the system's (Debian's
doctest-dev) where there is one; elsewhere PlatformIO fetches it.

All tests of a pin map are one program: main.cpp beside this file holds doctest's own code, test_units a file for each
subject. An environment of platformio.ini may name those that it builds (custom_units)."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import click
from platformio.test.exception import UnitTestSuiteError
from platformio.test.result import TestCase, TestCaseSource, TestStatus
from platformio.test.runners.doctest import DoctestTestRunner

SYSTEM_FOLDERS = [Path("/usr/include/doctest"), Path("/usr/local/include/doctest")]
FOLDER = next((folder for folder in SYSTEM_FOLDERS if (folder / "doctest.h").exists()), None)


class CustomTestRunner(DoctestTestRunner):  # type: ignore[misc]
    """Doctest without a download where the system has it, read by its XML report.

    PlatformIO's own reader wants every passed assertion printed and may lose the end of what a program prints.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        if FOLDER is not None or self.platform.is_embedded():
            self.EXTRA_LIB_DEPS = None  # nothing to fetch: it is there, or no test is built

    def configure_build_env(self, env: Any) -> None:
        """Makes `#include <doctest.h>` find the system's header, and takes the files that the environment names."""
        if FOLDER is not None:
            env.Append(CCFLAGS=[("-isystem", str(FOLDER))])
        units = env.GetProjectOption("custom_units", "").split()
        if units:
            beside = [pattern for pattern in env["PIOTEST_SRC_FILTER"] if "PIOTEST_RUNNING_NAME" not in pattern]
            env.Replace(PIOTEST_SRC_FILTER=[*beside, *(f"+<$PIOTEST_RUNNING_NAME/{unit}.cpp>" for unit in units)])
        env.AddBuildMiddleware(compiled_fast, "*/firmware/test/*.cpp")

    def stage_testing(self) -> None:
        """Runs the program; each of its test cases is one of PlatformIO's."""
        if self.options.without_testing:
            return
        build = Path(self.project_config.get("platformio", "build_dir"), self.test_suite.env_name)
        program = build / ("program.exe" if sys.platform == "win32" else "program")
        click.secho("Testing...", bold=True)
        done = subprocess.run([program, "--reporters=xml"], capture_output=True, text=True, check=False)
        click.echo(done.stderr, nl=False, err=True)
        report = re.search(r"<doctest .*</doctest>", done.stdout, re.DOTALL)
        if report is None:
            raise UnitTestSuiteError(f"the program ended with code {done.returncode} before its report was complete")
        failures = 0
        for element in ElementTree.fromstring(report[0]).iter("TestCase"):
            case = test_case(element)
            failures += case.status == TestStatus.FAILED
            self.test_suite.add_case(case)
            click.echo(case.humanize())
        if done.returncode != 0 and failures == 0:
            raise UnitTestSuiteError(f"the program ended with code {done.returncode} although no test case failed")


def compiled_fast(env: Any, source: Any) -> Any:
    """Compiles a test without optimisation, sanitizers and debug information, which are for the firmware: it takes
    longer to compile than to run. An assertion names its line all the same."""
    flags = [flag for flag in env["CCFLAGS"] if not str(flag).startswith(("-O", "-f", "-g"))]
    return env.Object(source, CCFLAGS=[*flags, "-O0", "-DDOCTEST_CONFIG_SUPER_FAST_ASSERTS"])


def test_case(element: ElementTree.Element) -> TestCase:
    """One test case from doctest's XML report, with a line for each assertion that failed."""
    source = TestCaseSource(element.attrib["filename"], int(element.attrib["line"]))
    if element.attrib.get("skipped") == "true":
        return TestCase(element.attrib["name"], TestStatus.SKIPPED, source=source)
    results = element.find("OverallResultsAsserts")
    passed = results is not None and results.attrib["test_case_success"] == "true"
    problems = [problem(found) for found in element.iter() if found.tag in ("Expression", "Exception", "Message")]
    status = TestStatus.PASSED if passed else TestStatus.FAILED
    return TestCase(element.attrib["name"], status, message="".join(problems) or None, source=source)


def problem(found: ElementTree.Element) -> str:
    """What went wrong, and where."""
    texts = [" ".join((found.findtext(tag) or "").split()) for tag in ("Original", "Expanded", "Text")]
    place = f"{found.attrib['filename']}:{found.attrib['line']}: " if "filename" in found.attrib else ""
    own_text = " ".join((found.text or "").split())
    return f"\n  {place}{found.attrib.get('type', found.tag)} " + "  ".join(filter(None, [own_text, *texts]))
