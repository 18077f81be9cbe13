"""Which recordings go to a worker together, and which must wait for the calibration of the one before."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from levelhead.corpora.job import Batch
from levelhead.corpora.places import Source
from levelhead.corpora.results import Done
from levelhead.corpora.work import next_prior, text_digest
from levelhead.open_types import JsonObject

MAX_RECORDINGS = 16  # of a batch: the loss of a killed worker, and enough to make Dask's time for a task negligible
MAX_BYTES = 32_000_000  # of a batch: long recordings go one by one


@dataclass
class Chain:
    """Recordings of one sensor, in order of time; the first ``start`` are done, or with the worker."""

    sensor: str
    sources: Sequence[Source]
    start: int = 0
    prior: str = ""
    alone: bool = False  # one recording at a time, because a worker died


@dataclass
class Plan:
    """Batches in the order in which they are to be run.

    Independent recordings go the largest first, so that none of the long ones is left for the end. A batch whose
    worker died is run again as single recordings when nothing else runs: then the one that kills workers is known.
    """

    ready: deque[Batch] = field(default_factory=deque)
    chains: dict[str, Chain] = field(default_factory=dict)
    suspects: deque[Batch] = field(default_factory=deque)
    recordings: int = 0
    bytes: int = 0
    todo: int = 0
    todo_bytes: int = 0
    _alone: set[Batch] = field(default_factory=set)  # batches of one recording whose other batch died

    def take(self, running: int) -> Batch | None:
        """The next batch that can run now beside ``running`` others; None: none, or not yet."""
        if self.ready:
            return self.ready.popleft()
        return self.suspects.popleft() if self.suspects and running == 0 else None

    def finish(self, batch: Batch, rows: list[JsonObject]) -> None:
        """The batch is done; the next one of its sensor may begin."""
        if batch.sensor:
            chain = self.chains[batch.sensor]
            for source in batch.sources:
                mine = [row for row in rows if row["recording"] == source.name]
                chain.prior = next_prior(mine, chain.prior)
            chain.start += len(batch.sources)
            self._continue(chain)

    def isolate(self, batch: Batch) -> bool:
        """The worker of a batch died; False if the one recording in it was run alone already."""
        if batch.sensor:
            chain = self.chains[batch.sensor]
            if chain.alone:
                return False
            chain.alone = True
            self.suspects.append(batch._replace(sources=batch.sources[:1]))
            return True
        if batch in self._alone:
            return False
        singles = [Batch((source,)) for source in batch.sources]
        self._alone.update(singles)
        self.suspects += singles
        return True

    def _continue(self, chain: Chain) -> None:
        rest = chain.sources[chain.start :]
        if rest:
            first = 1 if chain.alone else len(pack(rest)[0])
            batch = Batch(tuple(rest[:first]), chain.sensor, chain.prior, chain.start)
            (self.suspects if chain.alone else self.ready).append(batch)


def pack(sources: Sequence[Source], least: int = 1) -> list[tuple[Source, ...]]:
    """The recordings in their order, in batches; ``least``: how many batches there should be at least."""
    most = max(1, min(MAX_RECORDINGS, len(sources) // max(least, 1)))
    batches: list[list[Source]] = []
    size = 0
    for source in sources:
        if not batches or len(batches[-1]) >= most or size + source.size > MAX_BYTES:
            batches.append([])
            size = 0
        batches[-1].append(source)
        size += source.size
    return [tuple(batch) for batch in batches]


def make_plan(sources: Sequence[Source], done: Mapping[str, Done], sensors: Mapping[str, str], workers: int) -> Plan:
    """The work left to do.

    Args:
        sources: all recordings; those of a sensor in order of time.
        done: rows of earlier runs, by name.
        sensors: name of a recording -> its sensor; "" or not there: it is a sensor of its own.
        workers: how many will work.
    """
    plan = Plan(recordings=len(sources), bytes=sum(source.size for source in sources))
    single: list[Source] = []
    for source in sources:
        if sensor := sensors.get(source.name, ""):
            chain = plan.chains.setdefault(sensor, Chain(sensor, []))
            chain.sources = [*chain.sources, source]
        elif not _same(done.get(source.name), source, ""):
            single.append(source)
    single.sort(key=lambda source: (-source.size, source.name))
    plan.ready += [Batch(batch) for batch in pack(single, 4 * workers)]
    plan.todo, plan.todo_bytes = len(single), sum(source.size for source in single)
    for chain in plan.chains.values():
        _skip_done(chain, done)
        rest = chain.sources[chain.start :]
        plan.todo += len(rest)
        plan.todo_bytes += sum(source.size for source in rest)
        plan._continue(chain)
    return plan


def _same(known: Done | None, source: Source, prior: str) -> bool:
    return known is not None and known.stamp == source.stamp and known.prior == text_digest(prior)


def _skip_done(chain: Chain, done: Mapping[str, Done]) -> None:
    """Goes on after the last recording that was run as it would be run now."""
    for source in chain.sources:
        known = done.get(source.name)
        if known is None or not _same(known, source, chain.prior):
            return
        chain.prior = known.calibration or chain.prior
        chain.start += 1
