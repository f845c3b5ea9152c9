"""Words of numbers, dates, money, units, abbreviations and loan words, by one table for each language.

A language has a file ``<code>.tsv`` (``pt.tsv``), and a variety one with what differs (``pt-br.tsv``). `reading` walks
through a text; each kind of written form has a pattern and a reader. Words of numbers come from the rules of CLDR.
"""
