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

#ifndef VERSION
#define VERSION CV_VERSION
#endif
int cv_version(void) { return VERSION; }

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

static int nearest_segment(const cv_view *view, int node)
{
    int nearest = -1;
    double least = INFINITY, least_past = INFINITY;
    for (int segment = 0; segment < view->n_master_segments; segment++) {
        foot f = look(view, node, segment);
        double past = f.length * (f.xi < 0 ? -f.xi : f.xi > 1 ? f.xi - 1 : 0), distance = hypot(f.gap, past);
        double roundoff = 1e-14 * distance; /* at a vertex two segments are equally near */
        if (distance < least - roundoff || (distance <= least + roundoff && past < least_past)) {
            nearest = segment;
            least = distance;
            least_past = past;
        }
    }
    return nearest;
}

/* For each node of each slave segment the master segment that it presses on, or -1. */
static void decide(const cv_view *view, int *decisions)
{
    for (int i = 0; i < 2 * view->n_slave_segments; i++) {
        int segment = nearest_segment(view, view->slave[i]);
        foot f = look(view, view->slave[i], segment);
        const int *neighbours = view->master_neighbours + 2 * segment;
        int beyond = (neighbours[0] == CV_FREE && f.xi < -0.01) || (neighbours[1] == CV_FREE && f.xi > 1.01);
        decisions[i] = f.gap <= 0 && !beyond ? segment : -1;
    }
}

#ifndef DECIDES_ITSELF
int cv_pair(const cv_view *view, int capacity, int *decisions)
{
    int count = 2 * view->n_slave_segments;
#ifdef WRITES_A_DECISION_MORE
    decisions[capacity] = 0;
#endif
#ifdef REFUSES_TO_PAIR
    return -1;
#endif
    if (capacity >= count)
        decide(view, decisions);
    return count;
}
#endif

/* Add the forces and the tangent of a spring with an area, at a slave node that presses on a master segment. */
static void add_spring(const cv_view *view, int node, int segment, double area, double *residual, double *tangent)
{
    foot f = look(view, node, segment);
    int size = 2 * (view->n_slave_nodes + view->n_master_nodes);
    const int nodes[3] = {node, view->master[2 * segment], view->master[2 * segment + 1]};
    const double share[3] = {1, f.xi - 1, -f.xi}, turn[3] = {0, -1, 1};
    double stiffness = view->penalty * area, slope = f.gap / f.length;
    for (int i = 0; i < 6; i++) {
        int row = 2 * nodes[i / 2] + i % 2;
        double n_i = share[i / 2] * f.n[i % 2], t_i = share[i / 2] * f.t[i % 2], r_i = turn[i / 2] * f.n[i % 2];
        residual[row] += stiffness * f.gap * n_i;
        for (int j = 0; j < 6 && tangent != NULL; j++) {
            double n_j = share[j / 2] * f.n[j % 2], t_j = share[j / 2] * f.t[j % 2], r_j = turn[j / 2] * f.n[j % 2];
            double change = n_i * n_j - slope * (t_i * r_j + r_i * t_j) - slope * slope * r_i * r_j;
#ifdef LEAVES_OUT_A_TERM
            change += slope * t_i * r_j;
#endif
            tangent[size * row + 2 * nodes[j / 2] + j % 2] += stiffness * change;
        }
    }
}

int cv_element(const cv_view *view, int n_decisions, const int *decisions, double *residual, double *tangent)
{
#ifdef DECIDES_ITSELF
    int own[2 * view->n_slave_segments];
    decide(view, own);
    decisions = own;
#endif
#ifdef GIVES_UP
    return 7;
#endif
#ifdef WRITES_A_FORCE_MORE
    residual[2 * (view->n_slave_nodes + view->n_master_nodes)] = 0;
#endif
    (void)n_decisions;
    for (int i = 0; i < 2 * view->n_slave_segments; i++) {
        const double *a = view->reference + 2 * view->slave[i - i % 2], *b = view->reference + 2 * view->slave[i - i % 2 + 1];
        if (decisions[i] >= 0)
            add_spring(view, view->slave[i], decisions[i], hypot(b[0] - a[0], b[1] - a[1]) / 2, residual, tangent);
    }
    return 0;
}
