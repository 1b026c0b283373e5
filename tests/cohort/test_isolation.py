"""Whatever a case does to its process, it harms no other, and ends as a row with its reason."""

from __future__ import annotations

import json
from collections import Counter

import pytest

from benchmarks.faulty import Faulty
from heartgen import samples
from heartgen.cohort import Workers, batch, isolation
from heartgen.cohort.isolation import TRIES, NoProcessError, do_apart, end_idle
from heartgen.cohort.job import Job
from heartgen.errors import HeartgenError, InputError
from heartgen.options import Options

pytestmark = pytest.mark.slow

QUICK = Options(elements=(1, 4, 2), optimize=False)

REASONS = {
    "linalg": "heartgen itself failed (LinAlgError: SVD did not converge)",
    "memory": "the image needs more memory than there is here",
    "exits": "heartgen itself failed (SystemExit: no more)",
    "recursion": "heartgen itself failed (RecursionError: too deep)",
    "untellable": r"heartgen itself failed (CannotBeToldError: no letter: \udcff)",
    "os._exit": "its process died each time it was tried (exit code 3)",
    "killed": "its process died each time it was tried (SIGKILL)",
    "crashes": "its process died each time it was tried (SIGSEGV)",
    "hangs": "it was not done within",
}
"""How the reason begins for each deed."""


@pytest.fixture(scope="module")
def mask():
    return samples.lifelike_lv(4.0).mask


@pytest.fixture(scope="module", autouse=True)
def no_process_left():
    yield
    end_idle()


@pytest.fixture
def job(mask, tmp_path):
    """Make a job of one case."""

    def made(deed):
        case = Faulty(deed or "good", mask, deed=deed, log=tmp_path / "log")
        return Job(case.name, case, QUICK, (1,), tmp_path / "cases", ("vtu",))

    return made


def times_read(tmp_path):
    return Counter((tmp_path / "log").read_text().split())


def test_a_good_case_gives_its_row_and_its_folder(job, tmp_path):
    (row,) = do_apart(job(""))
    assert not row["status"].startswith("failed")
    names = sorted(file.name for file in (tmp_path / "cases" / "good").iterdir())
    assert names == ["mesh.vtu", "report.json", "rows.json"]


def test_a_process_is_kept_for_the_next_case_and_replaced_when_it_is_gone(job):
    end_idle()
    do_apart(job("linalg"))
    (first,) = isolation._idle
    do_apart(job("memory"))
    assert isolation._idle == [first]
    first.process.kill()
    first.process.wait()
    (row,) = do_apart(job("exits"))
    assert "SystemExit" in row["status"]
    assert isolation._idle != [first]


@pytest.mark.parametrize("deed", [name for name in REASONS if name != "hangs"])
def test_a_fault_becomes_the_reason_of_its_row(deed, job, tmp_path):
    (row,) = do_apart(job(deed))
    assert row["status"].startswith("failed: " + REASONS[deed])
    assert not row["success"]
    assert times_read(tmp_path)[deed] == (TRIES if "died each time" in REASONS[deed] else 1)
    record = json.loads((tmp_path / "cases" / deed / "rows.json").read_text())
    assert record["rows"] == [row]


@pytest.mark.parametrize("deed", ["killed", "linalg"])
def test_a_case_that_failed_is_not_read_again(deed, job, tmp_path):
    first = do_apart(job(deed))
    before = times_read(tmp_path)
    assert do_apart(job(deed)) == first
    assert times_read(tmp_path) == before


def test_a_case_that_hangs_is_given_up_at_once(job, tmp_path):
    end_idle()
    (row,) = do_apart(job("hangs"), limit=1.5)
    assert row["status"].startswith("failed: it was not done within 0.025 minutes")
    assert "--time-limit" in row["status"]
    assert times_read(tmp_path)["hangs"] == 1
    assert not isolation._idle


def test_a_case_that_takes_all_memory_is_given_up_at_once(job, tmp_path, monkeypatch):
    monkeypatch.setattr(isolation, "_memory", lambda: 1e9)
    (row,) = do_apart(job("hog"))
    assert row["status"].startswith("failed: it took more than 1.0 GB")
    assert times_read(tmp_path)["hog"] == 1


@pytest.mark.parametrize("deed", ["prints", "reads"])
def test_what_a_case_prints_or_reads_is_no_answer(deed, job):
    (row,) = do_apart(job(deed))
    assert not row["status"].startswith("failed")


def test_a_job_that_cannot_be_understood_ends_with_a_reason(job, monkeypatch):
    monkeypatch.setattr(isolation, "dumps", lambda job: b"nonsense")
    (row,) = do_apart(job(""))
    assert row["status"].startswith("failed: heartgen itself failed (UnpicklingError")


def test_no_process_at_all_is_no_fault_of_a_case(job, monkeypatch, tmp_path):
    end_idle()
    monkeypatch.setattr(isolation.sys, "executable", "/bin/false")
    with pytest.raises(NoProcessError, match="/bin/false does not import it"):
        do_apart(job(""))
    assert not (tmp_path / "cases").exists()


def test_a_folder_that_is_no_result_is_left_alone_and_not_worked_for(job, tmp_path):
    home = tmp_path / "cases" / "good"
    home.mkdir(parents=True)
    (home / "notes.txt").write_text("mine")
    (row,) = do_apart(job(""))
    assert "without the results of this case" in row["status"]
    assert not (tmp_path / "log").exists()
    assert [file.name for file in home.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"key": 1}', '{"key": 1, "rows": []}', '{"key": 1, "rows": "ab"}']
)
def test_a_record_that_was_damaged_is_not_believed(job, tmp_path, text):
    do_apart(job("linalg"))
    record = tmp_path / "cases" / "linalg" / "rows.json"
    record.write_text(text)
    (row,) = do_apart(job("linalg"))
    assert "without the results of this case" in row["status"]
    assert record.read_text() == text


def test_a_batch_of_faults_and_hearts_ends_with_all_hearts(mask, tmp_path):
    good = [Faulty(f"good{n}", mask, log=tmp_path / "log") for n in range(3)]
    bad = [Faulty(deed, mask, deed=deed, log=tmp_path / "log") for deed in REASONS]
    cases = [good[0], *bad[:4], good[1], *bad[4:], good[2]]

    def run():
        workers = Workers(2, time_limit=0.25)
        return batch(cases, tmp_path / "out", QUICK, workers=workers, formats=("vtu",))

    table = run()
    status = dict(zip(table["case"], table["status"], strict=True))
    assert list(status) == [case.name for case in cases]
    assert {name for name, found in status.items() if not found.startswith("failed")} == {
        case.name for case in good
    }
    assert all(status[deed].startswith("failed: " + REASONS[deed]) for deed in REASONS)
    before = times_read(tmp_path)
    assert {before[case.name] for case in good} == {1}
    again = run()
    assert list(again["status"]) == list(table["status"])
    assert times_read(tmp_path) == before


def test_a_worker_that_raises_all_the_same_stops_no_other():
    from heartgen.cohort.cluster import Died, connected, each

    with connected(Workers(1), 2) as client:
        found = dict(each(client, fails_on, [0, 1]))
        assert found[0] == "done"
        assert isinstance(found[1], Died)
        assert "ZeroDivisionError" in found[1].reason
        with pytest.raises(HeartgenError, match="the workers cannot run heartgen"):
            list(each(client, lacks, [0]))


def fails_on(number):
    if number:
        raise ZeroDivisionError
    return "done"


def lacks(number):
    raise ModuleNotFoundError("No module named 'heartgen'")


class Lost:
    """What Dask gives for a result that a worker took with it: once lost, then done again."""

    states = iter(["lost", "pending"])

    @property
    def status(self):
        return next(self.states, "finished")

    def result(self):
        return "done"

    def release(self):
        pass


def test_a_result_that_is_lost_with_its_worker_is_waited_for(monkeypatch):
    from heartgen.cohort import cluster

    class Completed(list):
        def __iter__(self):
            while self:
                yield self.pop()

        add = list.append

    class Client:
        def submit(self, *_, **__):
            return Lost()

        def cancel(self, *_, **__):
            pass

    monkeypatch.setattr(cluster, "as_completed", Completed)
    assert list(cluster.each(Client(), len, ["job"])) == [("job", "done")]


@pytest.mark.parametrize("limit", [0, -1, float("nan")])
def test_a_limit_of_no_time_is_refused(limit):
    with pytest.raises(InputError, match="no mesh is done: give more"):
        Workers(time_limit=limit)
