# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress that a running call reports: mapped to its share of the whole, thread by thread."""

import threading

import pytest

from adaptive_drt.parallel.call_progress import (
    iterate_with_progress,
    progress_range,
    report_progress,
    report_progress_to,
)


def test_what_is_told_within_parts():
    told = []
    with report_progress_to(told.append):
        report_progress(0.1)
        with progress_range(0.2, 0.6):
            report_progress(0.5)
            for _ in iterate_with_progress((1, 2)):
                report_progress(0.5)
        report_progress(0.7)
        with report_progress_to(lambda _: None):
            report_progress(0.8)
        report_progress(1.0)
    report_progress(0.3)
    assert told == pytest.approx([0.1, 0.4, 0.3, 0.5, 0.7, 1.0])


def test_each_thread_reports_to_its_own_callback():
    told, go = {"one": [], "two": []}, threading.Barrier(2)

    def run(name, first, last):
        with report_progress_to(told[name].append), progress_range(first, last):
            go.wait(60.0)
            for _ in iterate_with_progress(range(4)):
                report_progress(1.0)

    threads = [threading.Thread(target=run, args=("one", 0.0, 0.5)),
               threading.Thread(target=run, args=("two", 0.5, 1.0))]  # fmt: skip
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert told["one"] == pytest.approx([0.125, 0.25, 0.375, 0.5])
    assert told["two"] == pytest.approx([0.625, 0.75, 0.875, 1.0])


def test_ranges_end_with_an_exception():
    told = []
    with report_progress_to(told.append):
        with pytest.raises(ZeroDivisionError), progress_range(0.5, 0.75):
            report_progress(1 / 0)
        report_progress(0.5)
    assert told == [0.5]
