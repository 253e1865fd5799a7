/* Times emitted code: reads 21 parameters, the number of lines and the lines; then, for each j (row by row) or v (rows together)
 * that it reads, prints nanoseconds per line. */
#define _POSIX_C_SOURCE 199309L
#include "emitted.c"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define INPUTS 11
#define MOST 1000

static double x[MOST][INPUTS], together[MOST / 8][INPUTS][8];
static double r[MOST][5], dr_dq[MOST][5][21], r_together[MOST / 8][5][8], dr_dq_together[MOST / 8][5][21][8];

static double now(void)
{
    struct timespec at;
    clock_gettime(CLOCK_MONOTONIC, &at);
    return 1e9 * (double)at.tv_sec + (double)at.tv_nsec;
}

static int pass(const double *q, int lines, int what)
{
    struct vo_line_prepared p;
    int undefined = 0;
    vo_line_prepare(q, &p);
    if (what == 'j')
        for (int i = 0; i < lines; i++)
            undefined |= vo_line_jacobian(&p, x[i], r[i], dr_dq[i]);
    else
        for (int i = 0; i < lines / 8; i++)
            undefined |= vo_line_jacobian_rows(&p, together[i], r_together[i], dr_dq_together[i]);
    return undefined;
}

int main(void)
{
    double q[21];
    int lines;
    for (int i = 0; i < 21; i++)
        if (scanf("%lf", &q[i]) != 1)
            return 1;
    if (scanf("%d", &lines) != 1 || lines > MOST || lines % 8 != 0)
        return 1;
    for (int i = 0; i < lines; i++)
        for (int k = 0; k < INPUTS; k++) {
            if (scanf("%lf", &x[i][k]) != 1)
                return 1;
            together[i / 8][k][i % 8] = x[i][k];
        }
    for (int what = getchar(); what != EOF; what = getchar()) {
        if (what != 'j' && what != 'v')
            continue;
        int undefined = pass(q, lines, what), passes = 0;
        const double start = now();
        while (now() - start < 2e6) {
            undefined |= pass(q, lines, what);
            passes++;
        }
        printf("%.17g\n", undefined ? -1.0 : (now() - start) / passes / lines);
        fflush(stdout);
    }
    return 0;
}
