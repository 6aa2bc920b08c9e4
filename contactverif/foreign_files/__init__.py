"""Files that others wrote: what they may be, and how they are read so that a damaged one harms nobody."""
