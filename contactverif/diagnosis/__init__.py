"""Tell what kind of mistake a wrong formulation makes, from few calls on a mesh that one can draw by hand."""
