/* Usual samples run straight through update, and every block through correct; all else is rare and small. */
#include "lean_ekf.h"
#include "lean.h"

#define DEGREE 0.017453292f
#define PER_G 0.10197162f
#define BLOCK 0.02f
#define LONGEST 0.1f
#define GATE2 25.0f

static RARE void across_gap(lean_ekf *f, float dt)
{
    const float walk = 0.005f * DEGREE, uniform2 = 1.8137994f * 1.8137994f, turn2 = TURN * TURN * dt * dt;
    lean_covariance *const p = &f->p;
    float most = p->bxx > p->byy ? p->bxx : p->byy;
    most = p->bzz > most ? p->bzz : most;
    float bias = most + walk * walk * dt;
    bias = DEGREE * DEGREE < bias ? DEGREE * DEGREE : bias;
    bias = bias > most ? bias : most;
    const float tilt = (p->axx > p->ayy ? p->axx : p->ayy) + turn2, heading = p->azz + turn2;
    *p = (lean_covariance){.axx = uniform2 < tilt ? uniform2 : tilt, .bxx = bias, .byy = bias, .bzz = bias};
    p->ayy = p->axx;
    p->azz = uniform2 < heading ? uniform2 : heading;
}

/* More variance of attitude, which is independent of the bias then. */
static RARE void inflate(lean_covariance *p, float tilt, float heading)
{
    p->axx += tilt;
    p->ayy += tilt;
    p->azz += heading;
    for (float *one = &p->cxx; one <= &p->czz; one++) {
        *one = 0.0f;
    }
}

static RARE void begin(lean_ekf *f, const float *v)
{
    const float tilt = 5.0f * DEGREE;
    start_attitude(v, v + 3, &f->w);
    f->p = (lean_covariance){.axx = tilt * tilt, .ayy = tilt * tilt};
    f->p.azz = dot(v + 3, v + 3) > NO_LENGTH ? 1.0966227f : 0.0f;
    f->p.bxx = f->p.byy = f->p.bzz = DEGREE * DEGREE;
    for (float *one = f->bias; one <= &f->mag_out; one++) {
        *one = 0.0f;
    }
    f->force[2] = 1.0f;
}

/* An unusual sample: whether there is a step to do. */
static RARE bool unusual(lean_ekf *f, float *v, float dt)
{
    float unmeasured;
    const int kind = condition(&f->readings, f->bias, v, dt, &unmeasured);
    if (kind == START) {
        begin(f, v + 3);
        return false;
    }
    if (unmeasured > 0.0f) {
        inflate(&f->p, unmeasured, unmeasured);
        f->age = 0.0f;
    }
    if (kind == AFTER_GAP) {
        f->age = -dt;
    }
    return true;
}

static RARE void far_tilt(const float *force, float square, float *x, float *y)
{
    float longer;
    if (force[2] > 0.0f) {
        const float s = square / (square + force[2] * force[2]);
        longer = 1.0f + s * (1.0f / 6.0f + s * (3.0f / 40.0f + s * (15.0f / 336.0f + s * (105.0f / 3456.0f))));
    } else {
        const float level = root(square);
        if (level == 0.0f) {
            *x = 2.0f;
            *y = 0.0f;
            return;
        }
        longer = 2.0f / level - 0.7f;
        longer = 1.3f > longer ? 1.3f : longer;
    }
    *x = force[1] * longer;
    *y = -force[0] * longer;
}

static inline __attribute__((always_inline)) void predict(lean_ekf *f)
{
    const float w = f->w, x = f->x, y = f->y, z = f->z, time = f->time, h = 0.5f * time;
    const float noise = 0.1f * DEGREE, walk = 0.005f * DEGREE, walked = walk * walk * time;
    const float turn = noise * noise * time + 0.006f * 0.006f * f->rate2;
    lean_covariance *const p = &f->p;
    const float bxx = p->bxx, bxy = p->bxy, bxz = p->bxz, byy = p->byy, byz = p->byz, bzz = p->bzz;
    const float xx = h * (1.0f - 2.0f * (y * y + z * z)), xy = h * (2.0f * (x * y - w * z));
    const float xz = h * (2.0f * (x * z + w * y)), yx = h * (2.0f * (x * y + w * z));
    const float yy = h * (1.0f - 2.0f * (x * x + z * z)), yz = h * (2.0f * (y * z - w * x));
    const float zx = h * (2.0f * (x * z - w * y)), zy = h * (2.0f * (y * z + w * x));
    const float zz = h * (1.0f - 2.0f * (x * x + y * y));
    const float exx = p->cxx - (xx * bxx + xy * bxy + xz * bxz), exy = p->cxy - (xx * bxy + xy * byy + xz * byz);
    const float exz = p->cxz - (xx * bxz + xy * byz + xz * bzz);
    p->axx = p->axx - 4.0f * (exx * xx + exy * xy + exz * xz) + turn;
    const float eyx = p->cyx - (yx * bxx + yy * bxy + yz * bxz), eyy = p->cyy - (yx * bxy + yy * byy + yz * byz);
    const float eyz = p->cyz - (yx * bxz + yy * byz + yz * bzz);
    p->ayy = p->ayy - 4.0f * (eyx * yx + eyy * yy + eyz * yz) + turn;
    p->axy = p->axy - 2.0f * (exx * yx + exy * yy + exz * yz + eyx * xx + eyy * xy + eyz * xz);
    const float ezx = p->czx - (zx * bxx + zy * bxy + zz * bxz), ezy = p->czy - (zx * bxy + zy * byy + zz * byz);
    const float ezz = p->czz - (zx * bxz + zy * byz + zz * bzz);
    p->azz = p->azz - 4.0f * (ezx * zx + ezy * zy + ezz * zz) + turn;
    p->axz = p->axz - 2.0f * (exx * zx + exy * zy + exz * zz + ezx * xx + ezy * xy + ezz * xz);
    p->ayz = p->ayz - 2.0f * (eyx * zx + eyy * zy + eyz * zz + ezx * yx + ezy * yy + ezz * yz);
    p->cxx = 2.0f * exx - p->cxx;
    p->cxy = 2.0f * exy - p->cxy;
    p->cxz = 2.0f * exz - p->cxz;
    p->cyx = 2.0f * eyx - p->cyx;
    p->cyy = 2.0f * eyy - p->cyy;
    p->cyz = 2.0f * eyz - p->cyz;
    p->czx = 2.0f * ezx - p->czx;
    p->czy = 2.0f * ezy - p->czy;
    p->czz = 2.0f * ezz - p->czz;
    p->bxx = bxx + walked;
    p->byy = byy + walked;
    p->bzz = bzz + walked;
}

/* P less its share of the column (x, y, z, u, v, w), bias and turn by it; the block of tilt of P stands for heading. */
#define UPDATE(f, turn, x, y, z, u, v, w, s, innovation, TILT)                                                         \
    do {                                                                                                               \
        lean_covariance *const p_ = &(f)->p;                                                                           \
        const float x_ = x, y_ = y, z_ = z, u_ = u, v_ = v, w_ = w, one_ = 1.0f / (s), by_ = innovation;               \
        const float kx = x_ * one_, ky = y_ * one_, kz = z_ * one_, ku = u_ * one_, kv = v_ * one_, kw = w_ * one_;    \
        TILT(p_->axx -= kx * x_; p_->axy -= kx * y_; p_->ayy -= ky * y_; (turn)[0] += kx * by_; (turn)[1] += ky * by_;)   \
        p_->axz -= kx * z_;                                                                                            \
        p_->ayz -= ky * z_;                                                                                            \
        p_->azz -= kz * z_;                                                                                            \
        p_->cxx -= kx * u_;                                                                                            \
        p_->cxy -= kx * v_;                                                                                            \
        p_->cxz -= kx * w_;                                                                                            \
        p_->cyx -= ky * u_;                                                                                            \
        p_->cyy -= ky * v_;                                                                                            \
        p_->cyz -= ky * w_;                                                                                            \
        p_->czx -= kz * u_;                                                                                            \
        p_->czy -= kz * v_;                                                                                            \
        p_->czz -= kz * w_;                                                                                            \
        p_->bxx -= ku * u_;                                                                                            \
        p_->bxy -= ku * v_;                                                                                            \
        p_->bxz -= ku * w_;                                                                                            \
        p_->byy -= kv * v_;                                                                                            \
        p_->byz -= kv * w_;                                                                                            \
        p_->bzz -= kw * w_;                                                                                            \
        (turn)[2] += kz * by_;                                                                                         \
        (f)->bias[0] += ku * by_;                                                                                      \
        (f)->bias[1] += kv * by_;                                                                                      \
        (f)->bias[2] += kw * by_;                                                                                      \
    } while (0)
#define WITH(...) __VA_ARGS__
#define WITHOUT(...)

static inline __attribute__((always_inline)) void correct(lean_ekf *f, float dt)
{
    if (dt > GAP) {
        across_gap(f, dt);
    } else {
        predict(f);
    }
    lean_covariance *const p = &f->p;
    float turn[3] = {0.0f, 0.0f, 0.0f};
    const float time = f->time;
    if (f->acc_time > 0.0f) {
        const float *const force = f->force, square = force[0] * force[0] + force[1] * force[1];
        float x = force[1], y = -force[0];
        if (!(force[2] > 0.0f && square <= 0.04f * force[2] * force[2])) {
            far_tilt(force, square, &x, &y);
        }
        const float still = 0.2f * PER_G;
        const float r = (still * still + 0.1f * 0.1f * f->deviation2 / f->acc_time)
            / (LONGEST < f->acc_time ? LONGEST : f->acc_time);
        const float off2 = x * x + y * y;
        const bool beyond = off2 > GATE2 * ((p->ayy > p->axx ? p->ayy : p->axx) + r);
        const float out = f->acc_out + time;
        f->acc_out = out;
        if (!beyond || out + SLACK * time >= 1.0f) {
            if (beyond) {
                inflate(p, off2, off2);
            }
            f->acc_out = 0.0f;
            UPDATE(f, turn, p->axx, p->axy, p->axz, p->cxx, p->cxy, p->cxz, p->axx + r, x, WITH);
            UPDATE(f, turn, p->axy, p->ayy, p->ayz, p->cyx, p->cyy, p->cyz, p->ayy + r, y - turn[1], WITH);
        }
    }
    const float east = f->east, north = f->north;
    if (east != 0.0f || north != 0.0f) {
        const float level = root(east * east + north * north);
        float sine = 0.0f;
        if (level != 0.0f) {
            sine = north >= 0.0f ? east / level : east >= 0.0f ? 1.0f : -1.0f;
        }
        const float off = sine - turn[2];
        const float r = 900.0f * (DEGREE * DEGREE) / (LONGEST < time ? LONGEST : time), off2 = off * off;
        const bool beyond = off2 > GATE2 * (p->azz + r);
        const float out = f->mag_out + time;
        f->mag_out = out;
        if (!beyond || out + SLACK * time >= 1.0f) {
            if (beyond) {
                inflate(p, 0.0f, off2);
            }
            f->mag_out = 0.0f;
            UPDATE(f, turn, p->axz, p->ayz, p->azz, p->czx, p->czy, p->czz, p->azz + r, off, WITHOUT);
        }
    }
    const float across2 = turn[0] * turn[0] + turn[1] * turn[1], w = f->w, x = f->x, y = f->y, z = f->z;
    float s, c;
    half_angle(0.25f * (across2 + turn[2] * turn[2]), &s, &c);
    const float a = turn[0] * s, b = turn[1] * s, d = turn[2] * s;
    const float fx = f->force[0], fy = f->force[1], fz = f->force[2];
    if (across2 < 0.0001f) {
        f->force[0] = fx + turn[1] * fz;
        f->force[1] = fy - turn[0] * fz;
    } else {
        const float tx = 2.0f * (b * fz - d * fy), ty = 2.0f * (d * fx - a * fz), tz = 2.0f * (a * fy - b * fx);
        f->force[0] = fx + c * tx + b * tz - d * ty;
        f->force[1] = fy + c * ty + d * tx - a * tz;
        f->force[2] = fz + c * tz + a * ty - b * tx;
    }
    const float nw = c * w - a * x - b * y - d * z, nx = c * x + a * w + b * z - d * y;
    const float ny = c * y - a * z + b * w + d * x, nz = c * z + a * y - b * x + d * w;
    const float one = 1.5f - 0.5f * (nw * nw + nx * nx + ny * ny + nz * nz);
    f->w = nw * one;
    f->x = nx * one;
    f->y = ny * one;
    f->z = nz * one;
    f->time = f->rate2 = f->acc_time = f->deviation2 = f->east = f->north = 0.0f;
}

bool lean_ekf_update(lean_ekf *f, const float gyr[3], const float acc[3], const float mag[3], float dt)
{
    static const float none[3];
    gyr = gyr ? gyr : none;
    acc = acc ? acc : none;
    mag = mag ? mag : none;
    if (!(0.0f < dt && dt < 1e9f)) {
        return false;
    }
    float gx = gyr[0], gy = gyr[1], gz = gyr[2], ax = acc[0], ay = acc[1], az = acc[2];
    float mx = mag[0], my = mag[1], mz = mag[2];
    float gyr2 = gx * gx + gy * gy + gz * gz, force2 = ax * ax + ay * ay + az * az, field2 = mx * mx + my * my + mz * mz;
    const float usual = f->readings.interval, slack = SLACK * dt;
    if (f->readings.started && gyr2 + force2 + field2 < READING2 && dt <= GAP && dt + SLACK * usual < 2.0f * usual) {
        f->readings.interval = usual + (dt - usual) / INTERVALS;
        f->readings.last[0] = gx;
        f->readings.last[1] = gy;
        f->readings.last[2] = gz;
        f->readings.rate_age = 0.0f;
    } else {
        float v[9] = {gx, gy, gz, ax, ay, az, mx, my, mz};
        if (!unusual(f, v, dt)) {
            return true;
        }
        gx = v[0];
        gy = v[1];
        gz = v[2];
        ax = v[3];
        ay = v[4];
        az = v[5];
        mx = v[6];
        my = v[7];
        mz = v[8];
        gyr2 = gx * gx + gy * gy + gz * gz;
        force2 = ax * ax + ay * ay + az * az;
        field2 = mx * mx + my * my + mz * mz;
    }
    const float rx = (gx - f->bias[0]) * dt, ry = (gy - f->bias[1]) * dt, rz = (gz - f->bias[2]) * dt;
    float s, c;
    half_angle(0.25f * (rx * rx + ry * ry + rz * rz), &s, &c);
    const float hx = rx * s, hy = ry * s, hz = rz * s, qw = f->w, qx = f->x, qy = f->y, qz = f->z;
    const float w = (qw * c - qx * hx) - (qy * hy + qz * hz), x = (qw * hx + qx * c) + (qy * hz - qz * hy);
    const float y = (qw * hy + qy * c) + (qz * hx - qx * hz), z = (qw * hz + qz * c) + (qx * hy - qy * hx);
    const float age = f->age + dt;
    f->w = w;
    f->x = x;
    f->y = y;
    f->z = z;
    f->age = age;
    if (force2 > NO_LENGTH) {
        const float off = 0.005199106f * force2 - 0.5f, weight = dt / ((age < 2.0f ? age : 2.0f) + dt);
        const float tx = 2.0f * (y * az - z * ay), ty = 2.0f * (z * ax - x * az), tz = 2.0f * (x * ay - y * ax);
        f->acc_time += dt;
        f->deviation2 += off * off * dt;
        f->force[0] += weight * ((ax + w * tx + y * tz - z * ty) * PER_G - f->force[0]);
        f->force[1] += weight * ((ay + w * ty + z * tx - x * tz) * PER_G - f->force[1]);
        f->force[2] += weight * ((az + w * tz + x * ty - y * tx) * PER_G - f->force[2]);
    }
    if (field2 > NO_LENGTH) {
        const float tx = 2.0f * (y * mz - z * my), ty = 2.0f * (z * mx - x * mz), tz = 2.0f * (x * my - y * mx);
        f->east += mx + w * tx + y * tz - z * ty;
        f->north += my + w * ty + z * tx - x * tz;
    }
    f->rate2 += gyr2 * dt;
    f->time += dt;
    if (f->time + slack >= BLOCK) {
        correct(f, dt);
    }
    return true;
}

void lean_ekf_init(lean_ekf *f)
{
    *f = (lean_ekf){.w = 1.0f};
    f->force[2] = 1.0f;
}

lean_ekf_quat lean_ekf_quaternion(const lean_ekf *f)
{
    return (lean_ekf_quat){f->w, f->x, f->y, f->z};
}

lean_ekf_vec3 lean_ekf_bias(const lean_ekf *f)
{
    return (lean_ekf_vec3){f->bias[0], f->bias[1], f->bias[2]};
}
