static void run(void *memory, ptrdiff_t count, double last, const lh_rows *rows)
{
    static const double none[3] = {0.0, 0.0, 0.0};
    Filter *filter = memory;
    for (ptrdiff_t i = 0; i < count; i++) {
        const double *gyr = rows->gyr + 3 * i, *acc = rows->acc + 3 * i, *mag = rows->mag ? rows->mag + 3 * i : none;
        const double dt = rows->dt ? rows->dt[i] : rows->t[i] - last;
        last = rows->t ? rows->t[i] : last;
        $advance;
$aided
        double *quat = rows->quat + 4 * i;
        if (rows->bias) {
            Output out;
            $result;
            double *bias = rows->bias + 3 * i, *sigma = rows->sigma + 3 * i;
            quat[0] = out.quat.w, quat[1] = out.quat.x, quat[2] = out.quat.y, quat[3] = out.quat.z;
            bias[0] = out.bias.x, bias[1] = out.bias.y, bias[2] = out.bias.z;
            sigma[0] = out.sigma.x, sigma[1] = out.sigma.y, sigma[2] = out.sigma.z;
            rows->health[i] = (uint32_t)out.health;
        } else {
            const Quat out = $orientation;
            quat[0] = out.w, quat[1] = out.x, quat[2] = out.y, quat[3] = out.z;
        }
$place
    }
}
