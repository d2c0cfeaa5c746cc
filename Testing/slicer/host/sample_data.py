"""Stand-in for Slicer's SampleData module: it keeps what modules register and calls their load functions."""

from __future__ import annotations

import sys
import types
from typing import Any, ClassVar

import slicer


class SampleDataSource:
    def __init__(self, **fields: Any) -> None:
        self.__dict__.update(fields)


class SampleDataLogic:
    sources: ClassVar[list[SampleDataSource]] = []

    @staticmethod
    def registerCustomSampleDataSource(category: str = "Custom", **fields: Any) -> None:
        SampleDataLogic.sources.append(SampleDataSource(category=category, **fields))

    def downloadSamples(self, name: str) -> Any:
        source = next((s for s in self.sources if s.sampleName == name), None)
        if source is None:
            raise RuntimeError(f"no sample data called {name!r}; the test host downloads nothing")
        return source.customDownloader(source)


def install() -> None:
    module = types.ModuleType("SampleData")
    module.SampleDataLogic, module.SampleDataSource = SampleDataLogic, SampleDataSource
    module.downloadSamples = lambda name: SampleDataLogic().downloadSamples(name)
    module.downloadSample = lambda name: SampleDataLogic().downloadSamples(name)
    sys.modules["SampleData"] = module
    slicer.modules.sampledata = types.SimpleNamespace(name="SampleData")
