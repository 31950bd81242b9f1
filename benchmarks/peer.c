/* Copyright 2026 The cracked rotor rig authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The peer to beat: what a good engineer writes in C, eq. (5) of Hou et al. 2016 (variant
 * `derived`) and classical RK4, in SI. It shares the cage's sin and cos between the balls of both
 * bearings, allocates nothing, and leaves the rest to the compiler. */
#include <math.h>

#define BALLS_MAX 64

typedef struct {
    double m, m_b, k, damping_ratio, crack, beta, alpha, clearance, e, contact, cage_ratio;
    double speed, load;
    int balls;
    double cos_ball[BALLS_MAX], sin_ball[BALLS_MAX];
} Rotor;

static double breathing(double theta, double alpha)
{
    const double pi = 3.14159265358979323846;
    double low = alpha - 0.5 * pi;
    theta -= 2.0 * pi * floor((theta - low) / (2.0 * pi));
    if (theta <= 0.5 * pi - alpha) return 1.0;
    if (theta <= 0.5 * pi + alpha)
        return 0.5 * (1.0 + cos((theta - 0.5 * pi + alpha) * pi / (2.0 * alpha)));
    if (theta <= 1.5 * pi - alpha) return 0.0;
    return 0.5 * (1.0 + cos((theta - 1.5 * pi - alpha) * pi / (2.0 * alpha)));
}

static void derivative(const Rotor *r, const double *q, double t, double *d)
{
    double angle = r->speed * t, cage = r->cage_ratio * angle;
    double phi = atan2(q[1], q[0]);
    double psi = angle + r->beta;
    double f = breathing(psi - phi, r->alpha);
    double cp = cos(psi), sp = sin(psi), dk = r->crack * r->k;
    double ky = r->k - f * dk * cp * cp, kz = r->k - f * dk * sp * sp, kyz = -f * dk * sp * cp;
    double c = 2.0 * r->damping_ratio * r->m * r->speed, u = r->m * r->e * r->speed * r->speed;
    double a = 2.0 * q[0] - q[2] - q[4], b = 2.0 * q[1] - q[3] - q[5];
    double cc = cos(cage), sc = sin(cage), ball_c[BALLS_MAX], ball_s[BALLS_MAX];

    for (int j = 0; j < r->balls; j++) {
        ball_c[j] = cc * r->cos_ball[j] - sc * r->sin_ball[j];
        ball_s[j] = sc * r->cos_ball[j] + cc * r->sin_ball[j];
    }
    for (int i = 0; i < 6; i++) d[i] = q[6 + i];
    d[6] = (u * cos(angle) - c * (2.0 * q[6] - q[8] - q[10]) - ky * a - kyz * b) / r->m + r->load;
    d[7] = (u * sin(angle) - c * (2.0 * q[7] - q[9] - q[11]) - kz * b - kyz * a) / r->m;
    for (int i = 2; i < 6; i += 2) {
        double fy = 0.0, fz = 0.0;
        for (int j = 0; j < r->balls; j++) {
            double press = q[i] * ball_c[j] + q[i + 1] * ball_s[j] - r->clearance;
            if (press > 0.0) {
                double load = press * sqrt(press);
                fy += load * ball_c[j];
                fz += load * ball_s[j];
            }
        }
        d[6 + i] = (ky * (q[0] - q[i]) + kyz * (q[1] - q[i + 1]) + c * (q[6] - q[6 + i])
                    - r->contact * fy) / r->m_b + r->load;
        d[7 + i] = (kz * (q[1] - q[i + 1]) + kyz * (q[0] - q[i]) + c * (q[7] - q[7 + i])
                    - r->contact * fz) / r->m_b;
    }
}

/* Advance q (12 numbers, SI) by `steps` steps of h seconds from step number `first`. */
void advance(const Rotor *r, double *q, long first, long steps, double h)
{
    double k1[12], k2[12], k3[12], k4[12], x[12];
    for (long n = first; n < first + steps; n++) {
        double t = n * h;
        derivative(r, q, t, k1);
        for (int i = 0; i < 12; i++) x[i] = q[i] + 0.5 * h * k1[i];
        derivative(r, x, t + 0.5 * h, k2);
        for (int i = 0; i < 12; i++) x[i] = q[i] + 0.5 * h * k2[i];
        derivative(r, x, t + 0.5 * h, k3);
        for (int i = 0; i < 12; i++) x[i] = q[i] + h * k3[i];
        derivative(r, x, t + h, k4);
        for (int i = 0; i < 12; i++) q[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    }
}
