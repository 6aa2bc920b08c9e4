"""The same with an edge whose other node is beyond the master: forces of one slave node balance."""

import forces

forces.show(6.5)
