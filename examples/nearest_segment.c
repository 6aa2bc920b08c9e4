/* Answer a file of projection queries: the nearest segment to each point, the side, the foot and the distance.

       cc -O2 -o nearest_segment nearest_segment.c -lm
       ./nearest_segment < queries.txt > answers.txt

   Differences of coordinates come first, and all else is made of them. So an offset from the origin costs no digit. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct {
    int nodes, segments;
    double (*x)[2];     /* positions of the nodes */
    int (*ends)[2];     /* first and second node of each segment */
} Surface;

typedef struct {
    int surface, segment, sign;
    double x[2], xi, distance;
} Query;

static void project(const Surface *surface, Query *query)
{
    double best = HUGE_VAL, best_past = HUGE_VAL;
    for (int i = 0; i < surface->segments; i++) {
        const double *a = surface->x[surface->ends[i][0]], *b = surface->x[surface->ends[i][1]];
        double dx = b[0] - a[0], dy = b[1] - a[1], rx = query->x[0] - a[0], ry = query->x[1] - a[1];
        double squared = dx * dx + dy * dy, along = rx * dx + ry * dy, across = rx * dy - ry * dx;
        double distance = across * across / squared, past = 0;
        if (along <= 0) { /* The nearest place is the first node; `past` is how far the foot lies behind it. */
            distance = rx * rx + ry * ry;
            past = -along / sqrt(squared);
        } else if (along >= squared) {
            double qx = query->x[0] - b[0], qy = query->x[1] - b[1];
            distance = qx * qx + qy * qy;
            past = (along - squared) / sqrt(squared);
        }
        if (distance < best || (distance == best && past < best_past)) {
            best = distance;
            best_past = past;
            query->segment = i;
            query->sign = (across > 0) - (across < 0);
            query->xi = along / squared;
            query->distance = sqrt(distance);
        }
    }
}

static void read_surface(Surface *surface)
{
    if (scanf(" surface %*d %d %d", &surface->nodes, &surface->segments) != 2) exit(1);
    surface->x = malloc(surface->nodes * sizeof *surface->x);
    surface->ends = malloc(surface->segments * sizeof *surface->ends);
    for (int i = 0; i < surface->nodes; i++)
        if (scanf("%lf %lf", &surface->x[i][0], &surface->x[i][1]) != 2) exit(1);
    for (int i = 0; i < surface->segments; i++)
        if (scanf("%d %d", &surface->ends[i][0], &surface->ends[i][1]) != 2) exit(1);
}

int main(void)
{
    int n_surfaces, n_queries, c;
    if (scanf("contactverif-queries 1 %d %d", &n_surfaces, &n_queries) != 2) return 1;
    while ((c = getchar()) == '\n' || c == '#') /* Comments stand between the first line and the first surface. */
        while (c != '\n') c = getchar();
    ungetc(c, stdin);
    Surface *surfaces = malloc(n_surfaces * sizeof *surfaces);
    Query *queries = malloc((n_queries + 1) * sizeof *queries);
    for (int i = 0; i < n_surfaces; i++) read_surface(&surfaces[i]);
    for (int i = 0; i < n_queries; i++)
        if (scanf(" query %*d %d %lf %lf %*s", &queries[i].surface, &queries[i].x[0], &queries[i].x[1]) != 3) return 1;

    clock_t start = clock();
    for (int i = 0; i < n_queries; i++) project(&surfaces[queries[i].surface], &queries[i]);
    printf("# seconds %.9f\n", (double)(clock() - start) / CLOCKS_PER_SEC);
    for (int i = 0; i < n_queries; i++)
        printf("%d %d %d %.17g %.17g\n", i, queries[i].segment, queries[i].sign, queries[i].xi, queries[i].distance);
    return 0;
}
