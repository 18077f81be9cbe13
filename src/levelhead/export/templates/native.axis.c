typedef struct {
    $Params params;
    $State state;
} Filter;

static void set_params(void *memory, const lh_word *from)
{
    Filter *filter = memory;
$set_params
}

static void set_state(void *memory, const lh_word *from)
{
    Filter *filter = memory;
$set_state
}

static void get_state(const void *memory, lh_word *to)
{
    const Filter *filter = memory;
$get_state
}

static double tick(void *memory, double period, double level, double rate, double dt)
{
    Filter *filter = memory;
    const $Next next = $step;
$keep
    const $Report now = $read;
    return now.level;
}

static void run(void *memory, ptrdiff_t count, const double *t, const double *levels, const double *rates,
                double period, double *to)
{
    Filter *filter = memory;
    const $Params params = filter->params;
    $State state = filter->state;
    for (ptrdiff_t i = 0; i < count; i++, to += $report_words) {
        if (i > 0) {
            const double level = levels[i], rate = rates[i], dt = t[i] - t[i - 1];
            const $Next next = $step_row;
$keep_row
        }
        const $Report now = $read_row;
$report
    }
    filter->state = state;
}

const lh_axis_filter LH_SYMBOL($symbol) = {
    .name = "$name",
    .files = "$files",
    .digest = "$digest",
    .params_format = "$params_format",
    .state_format = "$state_format",
    .size = sizeof(Filter),
    .params = $params_words,
    .state = $state_words,
    .report = $report_words,
    .set_params = set_params,
    .set_state = set_state,
    .get_state = get_state,
    .run = run,
    .tick = tick,
};
