/* The functions by which contactverif calls a contact formulation in a library: contactverif verify c:file=PATH

   An element is a slave segment with the part of a master chain near it, or the whole interface (elements=interface).
   Both surfaces have their body on the left: on the way from the first to the second node of a segment. The gap is
   negative in penetration, the normal points out of the master body, and the residual is internal minus external force:
   a slave node in contact is pushed along +normal by -residual.

   C: arrays are row-major, the last index runs fastest. x[2 * i] and x[2 * i + 1] are the coordinates of node i, and
   tangent[size * i + j] is the derivative of residual[i] by coordinate j, where size = 2 * (number of nodes).
   Fortran: the same memory is column-major, so declare x(2, *), and tangent(size, size) with the derivative of
   residual(i) in tangent(j, i); with the option order=column it is expected in tangent(i, j). Numbers of nodes and
   segments begin with 0. */

#ifndef CONTACTVERIF_H
#define CONTACTVERIF_H

#define CV_VERSION 1
#define CV_FREE -1    /* no neighbour: the chain ends */
#define CV_OUTSIDE -2 /* a neighbour that does not belong to the element */

typedef struct {
    int n_slave_nodes, n_master_nodes; /* slave nodes come first */
    int n_slave_segments, n_master_segments;
    int n_props;
    int number;                   /* of the slave segment, for messages */
    double penalty;               /* nodal or distributed, as the trait `penalty` says */
    const double *reference;      /* [n_nodes][2], the reference configuration */
    const double *x;              /* [n_nodes][2], the current positions */
    const int *slave;             /* [n_slave_segments][2], nodes */
    const int *master;            /* [n_master_segments][2], nodes, in the order of a walk if the element is a segment */
    const int *slave_neighbours;  /* [n_slave_segments][2], the previous and the next segment, or one of the above */
    const int *master_neighbours; /* [n_master_segments][2] */
    const double *props;          /* [n_props], the option props=1:2.5 */
} cv_view;

#ifdef __cplusplus
extern "C" {
#endif

/* Return CV_VERSION. Required. */
int cv_version(void);

/* Return what the formulation promises, in TOML, see the documentation; without it a TOML file beside the library counts.
   Optional. */
const char *cv_traits(void);

/* Decide, in integers: who touches whom, what is active. Write at most `capacity` integers, each from -1 to the number of
   unknowns, and return how many there are; if there are more, the function is called again with as much room.
   Optional. Without it the element decides in cv_element, and the harness cannot freeze its decisions. */
int cv_pair(const cv_view *view, int capacity, int *decisions);

/* Write the residual [size] and, unless it is NULL, the tangent [size][size]. Both are zero before the call. Decide
   nothing here that cv_pair has decided. Return 0, or another number if that is impossible. Required. */
int cv_element(const cv_view *view, int n_decisions, const int *decisions, double *residual, double *tangent);

#ifdef __cplusplus
}
#endif

#endif
