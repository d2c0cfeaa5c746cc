"""From finished runs to bench.json, one self-contained HTML page and a part of RESULTS.md."""
