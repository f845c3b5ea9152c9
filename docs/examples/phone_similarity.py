"""Which phones look alike on a talker: neighbours, viseme classes, the table as CSV and a page with all figures.

    pip install '.[report]'
    python phone_similarity.py grid_s1

A talker of your own is given by its path. `similarity.csv` has a row and a column for each phone, `similarity.html` is
a page with dendrogram, reliability and agreement with articulation.
"""

import sys
from pathlib import Path

from corpus_tools.studies.similarity.analysis import SimilarityOptions
from corpus_tools.studies.similarity.write import table_csv, write_similarity

analysis = write_similarity(sys.argv[1], Path("similarity.html"), SimilarityOptions(classes=(6,), halves=10))
table = analysis.table
Path("similarity.csv").write_text(table_csv(table, "ipa"), encoding="utf-8")

print("phone tokens  most similar phones")
for phone, count, neighbours in zip(table.phones, table.counts, analysis.neighbours, strict=True):
    print(f"{phone:<5} {count:6}  " + ", ".join(f"{other} {similarity:.2f}" for other, similarity in neighbours))

[classes] = analysis.chosen
for number in range(classes.n_classes):
    members = [phone for phone, label in zip(table.phones, classes.labels, strict=True) if label == number]
    print(f"viseme {number + 1}: {' '.join(members)}")
print(
    f"silhouette {classes.silhouette:.2f}, split-half reliability {analysis.by_utterances.full_length_reliability:.2f}"
)
