"""A small corpus, once for the tests of a file."""

import pytest
from tests.reference.corpus import write_corpus


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    return write_corpus(tmp_path_factory.mktemp("recordings"))
