"""For conftest.py files (`from no_skips import *`): where CI=true a skipped test fails, as a part of CI that
did not run has not passed.

Exempt are tests on data and judges that lie beside the repository (../shared): they are no part of CI, as a
clone does not hold them.
"""

import os

import pytest

__all__ = ["pytest_make_collect_report", "pytest_runtest_makereport"]
BESIDE = "beside the repository"


def _failed_if_skipped(report):
    if (
        report.skipped
        and os.environ.get("CI") == "true"
        and BESIDE not in str(report.longrepr)
        and not hasattr(report, "wasxfail")
    ):
        report.outcome = "failed"
        report.longrepr = f"CI=true, and this could not run: {report.longrepr}"


@pytest.hookimpl(hookwrapper=True)
def pytest_make_collect_report(collector):
    outcome = yield
    _failed_if_skipped(outcome.get_result())


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    outcome = yield
    _failed_if_skipped(outcome.get_result())
