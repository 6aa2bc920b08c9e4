"""The same nodes with the search "search_nearest": all are in contact."""

import last_bucket

print("in contact:", last_bucket.nodes_in_contact("search_nearest"))
