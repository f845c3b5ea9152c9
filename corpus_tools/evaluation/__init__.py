"""How near synthesised lips come to real ones that were not learnt from."""
