"""The same scene with the master shifted by 0.01, so that no node faces a node: turning it changes nothing."""

import node_on_node

for degrees in (0, 1, 5, 30, 45, 90, 180):
    print(f"turned by {degrees:3}: force {node_on_node.push(degrees, 0.01):.2f}")
