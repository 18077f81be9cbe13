typedef struct {
    $Carry carry;
    $Settings settings;
} Filter;

static void set_settings(void *memory, const lh_word *from)
{
    Filter *filter = memory;
$set_settings
}

static void begin(void *memory, const lh_word *settings)
{
    Filter *filter = memory;
    set_settings(memory, settings);
    $begin;
}

static void set_carry(void *memory, const lh_word *from)
{
    Filter *filter = memory;
$set_carry
}

static void get_carry(const void *memory, lh_word *to)
{
    const Filter *filter = memory;
$get_carry
}

static void report(const void *memory, double said[11])
{
    const Filter *filter = memory;
    Output out;
    $result;
    said[0] = out.quat.w, said[1] = out.quat.x, said[2] = out.quat.y, said[3] = out.quat.z;
    said[4] = out.bias.x, said[5] = out.bias.y, said[6] = out.bias.z;
    said[7] = out.sigma.x, said[8] = out.sigma.y, said[9] = out.sigma.z;
    said[10] = out.health;
}

$aid
$run
$forward
const lh_imu_filter LH_SYMBOL($symbol) = {
    .name = "$name",
    .files = "$files",
    .digest = "$digest",
    .settings_format = "$settings_format",
    .carry_format = "$carry_format",
    .size = sizeof(Filter),
    .settings = $settings_words,
    .carry = $carry_words,
    .begin = begin,
    .set_settings = set_settings,
    .set_carry = set_carry,
    .get_carry = get_carry,
    .run = $run_or_null,
    .report = report,
    .aid = $aid_or_null,
    .width = $width,
    .forward = $forward_or_null,
};
