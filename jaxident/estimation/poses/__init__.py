"""Camera poses of whole runs: their likelihood under several noise laws, its search, and a weak prior."""
