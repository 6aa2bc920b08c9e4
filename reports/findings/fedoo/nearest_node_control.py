"""The same with the search "ipctk", which asks for elements near the node."""

import nearest_node

print(f"ipctk: force {nearest_node.force('ipctk'):.2f}, upwards")
