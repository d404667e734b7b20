"""Backends that play episodes: in this process, in a process pool, or on Dask workers."""

from __future__ import annotations

import multiprocessing
import os
import runpy
import signal
import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from itertools import islice
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any, Optional

from pogema_rs._counted import counted
from pogema_rs._optional import import_optional
from pogema_rs.toolbox._work import Outcome, Task, forget, play, play_here, play_with, reason
from pogema_rs.toolbox.registry import ToolboxRegistry

#: Episodes submitted per process, so that no process is idle.
_AHEAD = 2
#: Process deaths after which the lost episodes are reported as failed; also the retries on Dask.
_MAX_DEATHS = 3


def sequential(tasks: Iterable[Task]) -> Iterator[Outcome]:
    """Plays episodes one after the other in this process."""
    return map(play_here, tasks)


def processes(tasks: Iterable[Task], num_processes: int) -> Iterator[Outcome]:
    """Plays episodes in processes, and replays the episodes lost when a process dies."""
    # The tasks to submit next: those that were lost, and those that are not submitted yet.
    waiting: list[Task] = []
    rest, deaths, num_ahead = iter(tasks), 0, _AHEAD * num_processes
    while waiting or (waiting := list(islice(rest, 1))):
        under_way: dict[Future[Outcome], Task] = {}
        try:
            with process_pool(num_processes) as pool:
                while True:
                    waiting += islice(rest, max(0, num_ahead - len(under_way) - len(waiting)))
                    while waiting and len(under_way) < num_ahead:
                        # If the pool is broken, the task stays in `waiting`.
                        under_way[pool.submit(play, waiting[0])] = waiting[0]
                        del waiting[0]
                    if not under_way:
                        break
                    for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                        outcome = future.result()
                        del under_way[future]
                        yield outcome
        except BrokenProcessPool:
            deaths += 1
            # All futures are done now; some ended before the process died.
            finished = [future.result() for future in under_way if future.exception() is None]
            lost = [task for future, task in under_way.items() if future.exception() is not None]
            if deaths >= _MAX_DEATHS:
                ToolboxRegistry.warning(f"processes died {deaths} times; failed episodes: {len(lost)}")
                cause = f"its process, or another process of the pool, died {deaths} times"
                finished += [Outcome(task.index, error=cause) for task in lost]
                deaths = 0
            else:
                ToolboxRegistry.warning(f"a process died; playing {counted(len(lost), 'episode')} again")
                waiting = lost + waiting
            yield from finished


def dask(tasks: Iterable[Task], num_processes: int, address: Optional[str]) -> Iterator[Outcome]:
    """Plays episodes on the workers of a scheduler [default: a local cluster]; Dask replays those of a dead worker."""
    as_completed = import_optional("distributed", "a Dask backend").as_completed
    with dask_client(num_processes, address) as client:
        state = client.scatter(ToolboxRegistry.get_state(), broadcast=True, hash=False)
        rest = iter(tasks)
        submit = {"pure": False, "retries": _MAX_DEATHS}
        names: dict[Any, int] = {}

        def send(task: Task) -> Any:
            future = client.submit(play_with, state, task, **submit)
            names[future.key] = task.index
            return future

        def send_more() -> list[Any]:
            # Workers may join and leave at any time.
            num_ahead = _AHEAD * max(1, sum(client.nthreads().values()))
            return [send(task) for task in islice(rest, max(0, num_ahead - len(names)))]

        under_way = as_completed(send_more())
        for future in under_way:
            index = names.pop(future.key)
            if future.status == "finished":
                yield future.result()
            else:
                yield Outcome(index, error=f"on Dask: {reason(future.exception())}")
            under_way.update(send_more())


@contextmanager
def dask_client(num_processes: int, address: Optional[str]) -> Iterator[Any]:
    """Yields a client of a scheduler [default: a local cluster, which ends with the client].

    Errors: `ImportError` without Dask; `OSError` if the scheduler cannot be reached.
    """
    distributed = import_optional("distributed", "a Dask backend")
    cluster = None
    if address is None:
        cluster = distributed.LocalCluster(n_workers=num_processes, threads_per_worker=1, dashboard_address=None)
    try:
        client = distributed.Client(address if cluster is None else cluster, timeout="120s")
    except BaseException:
        if cluster is not None:
            cluster.close()
        raise
    try:
        yield client
    except BaseException:
        # Closing a worker waits for seconds until its episode ends.
        for worker in cluster.workers.values() if cluster is not None else ():
            worker.auto_restart = False
            if worker.pid:
                with suppress(ProcessLookupError):  # it has just ended
                    os.kill(worker.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
        raise
    finally:
        client.close()
        if cluster is not None:
            cluster.close()


#: The scripts that filled the registry, as absolute paths.
_scripts: list[str] = []


def register_by(script: str) -> None:
    """Runs a script that registers policies.

    Workers that are not forked run the script again, because they cannot import its classes.
    """
    # The script may change the current folder.
    path = os.path.abspath(script)
    runpy.run_path(path)
    _scripts.append(path)


@contextmanager
def process_pool(num_processes: int) -> Iterator[ProcessPoolExecutor]:
    """Yields a process pool whose workers end with this process, and immediately after an exception.

    Errors: ValueError for a registered object that the workers need and that cannot be pickled.
    """
    known = ToolboxRegistry.get_state()
    state: Optional[dict[str, Any]] = known
    if multiprocessing.get_start_method() != "fork":
        state = None if _scripts else _pickled(known)
    # Only this process keeps the writer open. Each worker waits until the pipe is closed, which also happens if this
    # process is killed.
    reader, writer = multiprocessing.Pipe(duplex=False)
    arguments = (state, _scripts, reader, writer)
    with reader, writer, ProcessPoolExecutor(num_processes, initializer=_initialize, initargs=arguments) as pool:
        try:
            yield pool
        except BaseException:
            writer.close()
            raise


def _pickled(state: dict[str, Any]) -> dict[str, Any]:
    """Returns a state of the registry whose parts can all be pickled."""
    for kind, known in state.items():
        for name, value in known.items():
            try:
                ForkingPickler.dumps(value)
            except Exception as error:  # noqa: BLE001 - an object may raise anything when it is pickled
                raise ValueError(
                    f"`{name}` of the registered {kind} cannot be sent to worker processes: {reason(error)}; register "
                    "a class or function from the top level of a module, or use the backend `sequential`"
                ) from None
    return state


def _initialize(state: Optional[dict[str, Any]], scripts: list[str], reader: Connection, writer: Connection) -> None:
    writer.close()
    # Ctrl-C reaches all processes of a terminal; the parent ends its workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, args=(reader,), daemon=True).start()
    # For libraries that a policy loads later, for example PyTorch. A library that is already loaded keeps its threads.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if state is None:
        for script in scripts:
            register_by(script)
    else:
        ToolboxRegistry.recreate_from_state(state)
    forget()  # a forked process has the algorithm of its parent


def _end_with_parent(reader: Connection) -> None:
    reader.poll(None)
    os._exit(1)
