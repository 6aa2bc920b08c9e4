/* Springs at slave nodes, each with half of the reference length of its segment, against the nearest master segment. */
#include <math.h>
#include <stddef.h>
#include "contactverif.h"

typedef struct {
    double length, t[2], n[2], gap, xi; /* of a master segment, and of a point against it */
} foot;

static foot look(const cv_view *view, int node, int segment)
{
    const double *p = view->x + 2 * node;
    const double *a = view->x + 2 * view->master[2 * segment], *b = view->x + 2 * view->master[2 * segment + 1];
    foot f;
    double along[2] = {b[0] - a[0], b[1] - a[1]}, arm[2] = {p[0] - a[0], p[1] - a[1]};
    f.length = hypot(along[0], along[1]);
    f.t[0] = along[0] / f.length;
    f.t[1] = along[1] / f.length;
    f.n[0] = f.t[1]; /* out of the master body, which lies on the left */
    f.n[1] = -f.t[0];
    f.gap = arm[0] * f.n[0] + arm[1] * f.n[1];
    f.xi = (arm[0] * f.t[0] + arm[1] * f.t[1]) / f.length;
    return f;
}

int cv_version(void) { return CV_VERSION; }

const char *cv_traits(void)
{
    return "tangent = 'exact'\n"
           "symmetric = true\n"
           "conserves_force = true\n"
           "conserves_moment = true\n"
           "local = true\n"
           "nodes_push = true\n"
           "flat = false\n"
           "normal = true\n"
           "penalty = 'distributed'\n"
           "area = 'reference'\n"
           "gap = 'closest point'\n"
           "force_along = 'master normal'\n"
           "witnesses = {patch = 'b'}\n";
}

/* Two decisions: for each node of the slave segment the master segment that it presses on, or -1. */
int cv_pair(const cv_view *view, int capacity, int *decisions)
{
    if (capacity < 2)
        return 2;
    for (int end = 0; end < 2; end++) {
        int nearest = -1;
        double least = INFINITY, least_past = INFINITY;
        for (int segment = 0; segment < view->n_master_segments; segment++) {
            foot f = look(view, end, segment);
            double past = f.length * (f.xi < 0 ? -f.xi : f.xi > 1 ? f.xi - 1 : 0), distance = hypot(f.gap, past);
            double roundoff = 1e-14 * least; /* at a vertex two segments are equally near */
            if (distance < least - roundoff || (distance <= least + roundoff && past < least_past)) {
                nearest = segment;
                least = distance;
                least_past = past;
            }
        }
        foot f = look(view, end, nearest);
        const int *neighbours = view->master_neighbours + 2 * nearest;
        int beyond = (neighbours[0] == CV_FREE && f.xi < -0.01) || (neighbours[1] == CV_FREE && f.xi > 1.01);
        decisions[end] = f.gap <= 0 && !beyond ? nearest : -1;
    }
    return 2;
}

int cv_element(const cv_view *view, int n_decisions, const int *decisions, double *residual, double *tangent)
{
    (void)n_decisions;
    const double *a = view->reference, *b = view->reference + 2;
    double area = hypot(b[0] - a[0], b[1] - a[1]) / 2;
    int size = 2 * (view->n_slave_nodes + view->n_master_nodes);
    for (int end = 0; end < 2; end++) {
        if (decisions[end] < 0)
            continue;
        foot f = look(view, end, decisions[end]);
        const int nodes[3] = {end, view->master[2 * decisions[end]], view->master[2 * decisions[end] + 1]};
        const double share[3] = {1, f.xi - 1, -f.xi}, turn[3] = {0, -1, 1};
        double stiffness = view->penalty * area, slope = f.gap / f.length;
        for (int i = 0; i < 6; i++) {
            int row = 2 * nodes[i / 2] + i % 2;
            double n_i = share[i / 2] * f.n[i % 2], t_i = share[i / 2] * f.t[i % 2], r_i = turn[i / 2] * f.n[i % 2];
            residual[row] += stiffness * f.gap * n_i;
            if (tangent == NULL)
                continue;
            for (int j = 0; j < 6; j++) {
                double n_j = share[j / 2] * f.n[j % 2], t_j = share[j / 2] * f.t[j % 2], r_j = turn[j / 2] * f.n[j % 2];
                double change = n_i * n_j - slope * (t_i * r_j + r_i * t_j) - slope * slope * r_i * r_j;
                tangent[size * row + 2 * nodes[j / 2] + j % 2] += stiffness * change;
            }
        }
    }
    return 0;
}
