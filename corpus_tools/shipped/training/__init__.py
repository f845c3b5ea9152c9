"""Networks and distributions of shipped files, learnt from recordings of several people and voices."""
