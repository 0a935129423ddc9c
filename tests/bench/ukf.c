/* The plain UKF run of ftproc/core/filtering/forward.py:run_weighted in C, step for step, as the yardstick of its speed. */

#include <math.h>
#include <stdint.h>

#define SPREAD 3.0
#define MAX_SPREAD_IN_RANGES 0.3
#define MIN_RANGE_M 1.0

typedef double M9[9][9];
typedef double M3[3][3];

static double turn(double cross, double dot) {
    if (!(fabs(cross) < 0.05 * dot)) return atan2(cross, dot);
    double t = cross / dot, q = t * t;
    return t * (1 - q * (1.0 / 3 - q * (1.0 / 5 - q * (1.0 / 7 - q * (1.0 / 9 - q * (1.0 / 11 - q / 13))))));
}

static double wrap(double a) {
    return -M_PI <= a && a < M_PI ? a : a - 2 * M_PI * floor((a + M_PI) / (2 * M_PI));
}

static void predict(double *x, M9 p, double t, const double *jerk) {
    double h = 0.5 * t * t, t2 = t * t, t3 = t2 * t;
    double c00 = t3 * t2 / 20, c01 = t2 * t2 / 8, c02 = t3 / 6, c11 = t3 / 3, c12 = t2 / 2, c22 = t;
    for (int i = 0; i < 3; i++) {
        x[i] += t * x[i + 3] + h * x[i + 6];
        x[i + 3] += t * x[i + 6];
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double q = i == j ? jerk[i] : 0;
            double pa = p[i][6 + j] + t * p[3 + i][6 + j] + h * p[6 + i][6 + j];
            double pv = p[i][3 + j] + t * p[3 + i][3 + j] + h * p[6 + i][3 + j];
            double pp = p[i][j] + t * p[3 + i][j] + h * p[6 + i][j];
            double va = p[3 + i][6 + j] + t * p[6 + i][6 + j];
            double vv = p[3 + i][3 + j] + t * p[6 + i][3 + j];
            double vp = p[3 + i][j] + t * p[6 + i][j];
            double aa = p[6 + i][6 + j], av = p[6 + i][3 + j], ap = p[6 + i][j];
            p[i][j] = pp + t * pv + h * pa + q * c00;
            p[i][3 + j] = pv + t * pa + q * c01;
            p[i][6 + j] = pa + q * c02;
            p[3 + i][j] = vp + t * vv + h * va + q * c01;
            p[3 + i][3 + j] = vv + t * va + q * c11;
            p[3 + i][6 + j] = va + q * c12;
            p[6 + i][j] = ap + t * av + h * aa + q * c02;
            p[6 + i][3 + j] = av + t * aa + q * c12;
            p[6 + i][6 + j] = aa + q * c22;
        }
}

static void linearise(const double *x, M9 p, double *z_hat, M3 h, M3 c) {
    M3 l = {{0}}, b;
    double floor_ = 1e-12 * (p[0][0] + p[1][1] + p[2][2]) + 1e-300;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++) {
            double s = p[i][j];
            for (int k = 0; k < j; k++) s -= l[i][k] * l[j][k];
            l[i][j] = i == j ? sqrt(fmax(s, floor_)) : s / l[j][j];
        }
    double px = x[0], py = x[1], pz = x[2], ground = sqrt(px * px + py * py);
    double slant = fmax(sqrt(px * px + py * py + pz * pz), MIN_RANGE_M);
    double widest = sqrt(p[0][0] + p[1][1] + p[2][2]), spread = SPREAD;
    if (spread * widest > MAX_SPREAD_IN_RANGES * slant) spread = MAX_SPREAD_IN_RANGES * slant / widest;
    double alpha2 = spread * spread / (SPREAD * SPREAD), weight = 0.5 / (spread * spread);
    double m[3] = {0}, g[3][3] = {{0}};
    for (int j = 0; j < 3; j++) {
        double d[2][3];
        for (int side = 0; side < 2; side++) {
            double by = side ? -spread : spread;
            double ux = px + by * l[0][j], uy = py + by * l[1][j], uz = pz + by * l[2][j];
            double ug2 = ux * ux + uy * uy, ug = sqrt(ug2);
            d[side][0] = fmax(sqrt(ug2 + uz * uz), MIN_RANGE_M) - slant;
            d[side][1] = turn(px * uy - py * ux, px * ux + py * uy);
            d[side][2] = turn(ground * uz - pz * ug, ground * ug + pz * uz);
        }
        for (int i = 0; i < 3; i++) {
            m[i] += d[0][i] + d[1][i];
            b[j][i] = (d[0][i] - d[1][i]) / (2 * spread);
            for (int k = 0; k <= i; k++) g[i][k] += d[0][i] * d[0][k] + d[1][i] * d[1][k];
        }
    }
    for (int i = 0; i < 3; i++) m[i] *= weight;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k <= i; k++) c[i][k] = c[k][i] = weight * g[i][k] - alpha2 * m[i] * m[k];
    z_hat[0] = slant + m[0];
    z_hat[1] = atan2(py, px) + m[1];
    z_hat[2] = atan2(pz, ground) + m[2];
    for (int i = 0; i < 3; i++) {
        h[i][2] = b[2][i] / l[2][2];
        h[i][1] = (b[1][i] - l[2][1] * h[i][2]) / l[1][1];
        h[i][0] = (b[0][i] - l[1][0] * h[i][1] - l[2][0] * h[i][2]) / l[0][0];
    }
}

static double invert_used(M3 s, const double *used, M3 out) {
    int on0 = used[0] > 0, on1 = used[1] > 0, on2 = used[2] > 0;
    double a = on0 ? sqrt(s[0][0]) : 1, b = on0 && on1 ? s[1][0] / a : 0, c = on0 && on2 ? s[2][0] / a : 0;
    double d = on1 ? sqrt(s[1][1] - b * b) : 1, e = on1 && on2 ? (s[2][1] - c * b) / d : 0;
    double f = on2 ? sqrt(s[2][2] - c * c - e * e) : 1;
    double ia = 1 / a, id = 1 / d, iff = 1 / f, ib = -b * ia * id, ie = -e * id * iff, ic = -(c * ia + e * ib) * iff;
    out[0][0] = on0 ? ia * ia + ib * ib + ic * ic : 0;
    out[1][1] = on1 ? id * id + ie * ie : 0;
    out[2][2] = on2 ? iff * iff : 0;
    out[0][1] = out[1][0] = on0 && on1 ? ib * id + ic * ie : 0;
    out[0][2] = out[2][0] = on0 && on2 ? ic * iff : 0;
    out[1][2] = out[2][1] = on1 && on2 ? ie * iff : 0;
    return 2 * log(a * d * f);
}

/* The log-likelihood gained. The Joseph form for priors that dwarf the noise is left out: no such start is timed. */
static double update(double *x, M9 p, M3 c, M3 h, const double *e, const double *noise, const double *used,
                     double *nis_out) {
    double pxz[9][3], gain[9][3], nis = 0;
    M3 s, inverse;
    for (int i = 0; i < 9; i++)
        for (int j = 0; j < 3; j++) pxz[i][j] = p[i][0] * h[j][0] + p[i][1] * h[j][1] + p[i][2] * h[j][2];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) s[i][j] = c[i][j];
        if (used[i] > 0) s[i][i] += noise[i] / used[i];
    }
    double log_det = invert_used(s, used, inverse);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (used[i] > 0 && used[j] > 0) nis += e[i] * inverse[i][j] * e[j];
    for (int i = 0; i < 9; i++)
        for (int j = 0; j < 3; j++)
            gain[i][j] = pxz[i][0] * inverse[0][j] + pxz[i][1] * inverse[1][j] + pxz[i][2] * inverse[2][j];
    for (int j = 0; j < 3; j++)
        if (used[j] > 0)
            for (int i = 0; i < 9; i++) x[i] += gain[i][j] * e[j];
    for (int i = 0; i < 9; i++)
        for (int j = 0; j <= i; j++)
            p[i][j] = p[j][i] = p[i][j] - gain[i][0] * pxz[j][0] - gain[i][1] * pxz[j][1] - gain[i][2] * pxz[j][2];
    *nis_out = nis;
    return -0.5 * (log_det + nis);
}

static void line_of_sight_sigma(const double *x, M9 p, double *out) {
    double ground = fmax(sqrt(x[0] * x[0] + x[1] * x[1]), 1e-9), slant = sqrt(ground * ground + x[2] * x[2]);
    double ca = x[0] / ground, sa = x[1] / ground, ce = ground / slant, se = x[2] / slant;
    double axes[3][3] = {{ca * ce, sa * ce, se}, {-sa, ca, 0}, {-ca * se, -sa * se, ce}};
    for (int a = 0; a < 3; a++)
        for (int o = 0; o < 6; o += 3) {
            double u = axes[a][0], v = axes[a][1], w = axes[a][2];
            double variance = u * u * p[o][o] + v * v * p[o + 1][o + 1] + w * w * p[o + 2][o + 2] +
                              2 * (u * v * p[o][o + 1] + u * w * p[o][o + 2] + v * w * p[o + 1][o + 2]);
            out[o + a] = sqrt(fmax(variance, 0));
        }
}

/* Samples 0 ... n - 1 from the state x, P, which are changed in place; returns the log-likelihood. */
double run(int64_t n, const double *time, const double *z, const double *weight, const double *noise,
           const double *jerk, double *x, M9 p, double *state, double *predicted, double *sigma, double *innovation,
           double *innovation_sigma, double *weight_used, double *nis, double *los_sigma, int64_t *since_start) {
    double likelihood = 0;
    for (int64_t k = 0; k < n; k++) {
        double z_hat[3], e[3], used[3];
        M3 h, c;
        int any = 0;
        if (k > 0) predict(x, p, time[k] - time[k - 1], jerk);
        for (int i = 0; i < 9; i++) predicted[9 * k + i] = x[i];
        linearise(x, p, z_hat, h, c);
        for (int i = 0; i < 3; i++) e[i] = z[3 * k + i] - z_hat[i];
        if (isfinite(e[1])) e[1] = wrap(e[1]);
        for (int i = 0; i < 3; i++) {
            innovation[3 * k + i] = e[i];
            innovation_sigma[3 * k + i] = sqrt(c[i][i] + noise[i]);
            weight_used[3 * k + i] = used[i] = isfinite(e[i]) ? weight[3 * k + i] : 0;
            any = any || used[i] > 0;
        }
        if (any) likelihood += update(x, p, c, h, e, noise, used, &nis[k]);
        for (int i = 0; i < 9; i++) {
            state[9 * k + i] = x[i];
            sigma[9 * k + i] = sqrt(fmax(p[i][i], 0));
        }
        line_of_sight_sigma(x, p, los_sigma + 6 * k);
        since_start[k] = k;
    }
    return likelihood;
}
