/* The Python module around the filters of the native engine.
 *
 * Limited API of Python 3.11: one build serves all later versions. Arrays come and go through the buffer protocol.
 */
#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include "native.h"
#include "native.table.h"

#include <string.h>

#define LINE 64 /* bytes of a cache line, where a filter begins */

#define DECLARE_IMU(name) extern const lh_imu_filter lh_imu_##name;
#define DECLARE_WIDE(name) extern const lh_imu_filter lh_imu_##name##_wide;
#define DECLARE_SMOOTHER(name) extern const lh_smoother lh_smoother_##name;
#define DECLARE_WIDE_SMOOTHER(name) extern const lh_smoother lh_smoother_##name##_wide;
#define DECLARE_WIDEST_SMOOTHER(name) extern const lh_smoother lh_smoother_##name##_widest;
#define DECLARE_AXIS(name) extern const lh_axis_filter lh_axis_##name;
#define ADDRESS_IMU(name) &lh_imu_##name,
#define ADDRESS_WIDE(name) &lh_imu_##name##_wide,
#define ADDRESS_SMOOTHER(name) &lh_smoother_##name,
#define ADDRESS_WIDE_SMOOTHER(name) &lh_smoother_##name##_wide,
#define ADDRESS_WIDEST_SMOOTHER(name) &lh_smoother_##name##_widest,
#define ADDRESS_AXIS(name) &lh_axis_##name,

LH_IMU_FILTERS(DECLARE_IMU)
LH_AXIS_FILTERS(DECLARE_AXIS)
LH_SMOOTHERS(DECLARE_SMOOTHER)
static const lh_imu_filter *const IMU_FILTERS[] = {LH_IMU_FILTERS(ADDRESS_IMU) NULL};
static const lh_axis_filter *const AXIS_FILTERS[] = {LH_AXIS_FILTERS(ADDRESS_AXIS) NULL};
static const lh_smoother *const SMOOTHERS[] = {LH_SMOOTHERS(ADDRESS_SMOOTHER) NULL};
#if defined(LH_WITH_WIDE)
LH_WIDE_FILTERS(DECLARE_WIDE)
LH_SMOOTHERS(DECLARE_WIDE_SMOOTHER)
LH_SMOOTHERS(DECLARE_WIDEST_SMOOTHER)
static const lh_imu_filter *const WIDE_FILTERS[] = {LH_WIDE_FILTERS(ADDRESS_WIDE) NULL};
static const lh_smoother *const WIDE_SMOOTHERS[] = {LH_SMOOTHERS(ADDRESS_WIDE_SMOOTHER) NULL};
static const lh_smoother *const WIDEST_SMOOTHERS[] = {LH_SMOOTHERS(ADDRESS_WIDEST_SMOOTHER) NULL};
#else
static const lh_imu_filter *const WIDE_FILTERS[] = {NULL};
static const lh_smoother *const WIDE_SMOOTHERS[] = {NULL};
static const lh_smoother *const WIDEST_SMOOTHERS[] = {NULL};
#endif

/* ---- Memory and words */

typedef struct {
    PyObject_HEAD
    const void *filter;
    void *raw, *memory;
} Object;

/* Memory for a filter; the object owns it. */
static int allocate(Object *self, size_t size)
{
    self->raw = PyMem_Calloc(1, size + LINE);
    if (!self->raw) {
        PyErr_NoMemory();
        return -1;
    }
    self->memory = (void *)(((uintptr_t)self->raw + LINE - 1) / LINE * LINE);
    return 0;
}

static void deallocate(PyObject *object)
{
    PyTypeObject *type = Py_TYPE(object);
    PyMem_Free(((Object *)object)->raw);
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);
    release(object);
    Py_DECREF(type);
}

/* The words in a bytes object of exactly so many. */
static const lh_word *words(PyObject *bytes, ptrdiff_t count)
{
    char *data;
    Py_ssize_t length;
    if (PyBytes_AsStringAndSize(bytes, &data, &length) < 0) {
        return NULL;
    }
    if (length != count * (Py_ssize_t)sizeof(lh_word)) {
        PyErr_Format(PyExc_ValueError, "%zd bytes instead of %zd", length, count * (Py_ssize_t)sizeof(lh_word));
        return NULL;
    }
    return (const lh_word *)data;
}

/* A new bytes object of so many words, and where they are. */
static PyObject *empty_words(ptrdiff_t count, lh_word **at)
{
    PyObject *bytes = PyBytes_FromStringAndSize(NULL, count * (Py_ssize_t)sizeof(lh_word));
    if (bytes) {
        *at = (lh_word *)PyBytes_AsString(bytes);
    }
    return bytes;
}

static int counted(Py_ssize_t given, Py_ssize_t wanted)
{
    if (given != wanted) {
        PyErr_Format(PyExc_TypeError, "%zd arguments instead of %zd", given, wanted);
        return -1;
    }
    return 0;
}

static int number(PyObject *object, double *to)
{
    *to = PyFloat_AsDouble(object);
    return *to == -1.0 && PyErr_Occurred() ? -1 : 0;
}

/* Three floats or doubles of an array; 0: it holds other numbers. */
static int three_of_buffer(PyObject *object, double to[3])
{
    Py_buffer view;
    if (PyObject_GetBuffer(object, &view, PyBUF_STRIDED_RO | PyBUF_FORMAT) < 0) {
        return -1;
    }
    const char type = view.format && view.format[1] == '\0' ? view.format[0] : '?';
    int found = type == 'd' || type == 'f';
    if (view.ndim != 1 || view.shape[0] != 3) {
        PyErr_SetString(PyExc_TypeError, "a row of three numbers is needed");
        found = -1;
    }
    for (Py_ssize_t k = 0; found == 1 && k < 3; k++) {
        const char *from = (const char *)view.buf + k * view.strides[0];
        float single;
        if (type == 'd') {
            memcpy(to + k, from, sizeof *to);
        } else {
            memcpy(&single, from, sizeof single);
            to[k] = single;
        }
    }
    PyBuffer_Release(&view);
    return found;
}

/* Three numbers: of a tuple, a list, an array, or any other sequence. */
static int three(PyObject *object, double to[3])
{
    const int list = PyList_Check(object);
    if (!list && !PyTuple_Check(object)) {
        const int found = PyObject_CheckBuffer(object) ? three_of_buffer(object, to) : 0;
        if (found != 0) {
            return found < 0 ? -1 : 0;
        }
        PyObject *tuple = PySequence_Tuple(object);
        const int failed = tuple ? three(tuple, to) : -1;
        Py_XDECREF(tuple);
        return failed;
    }
    if ((list ? PyList_Size(object) : PyTuple_Size(object)) != 3) {
        PyErr_SetString(PyExc_TypeError, "three numbers are needed");
        return -1;
    }
    for (Py_ssize_t k = 0; k < 3; k++) {
        if (number(list ? PyList_GetItem(object, k) : PyTuple_GetItem(object, k), to + k) < 0) {
            return -1;
        }
    }
    return 0;
}

static int interval(PyObject *object, double *dt)
{
    if (number(object, dt) < 0) {
        return -1;
    }
    if (!(0.0 < *dt && *dt < LH_LONGEST)) {
        PyErr_SetString(PyExc_ValueError, "dt");
        return -1;
    }
    return 0;
}

static PyObject *numbers(const double *values, Py_ssize_t count)
{
    PyObject *tuple = PyTuple_New(count);
    for (Py_ssize_t k = 0; tuple && k < count; k++) {
        PyObject *value = PyFloat_FromDouble(values[k]);
        if (!value) {
            Py_DECREF(tuple);
            return NULL;
        }
        PyTuple_SetItem(tuple, k, value);
    }
    return tuple;
}

/* ---- Arguments that are arrays */

#define MOST 16 /* arrays of one call */

/* The arguments of a call. After the first that is not as it should be, `failed` is set, a Python error too, and all
 * others are NULL: a function takes what it needs and asks once. */
typedef struct {
    PyObject *const *next;
    Py_buffer views[MOST];
    int count, failed;
} Arguments;

/* The numbers of the next array: so many (-1: any number), each of so many bytes. */
static void *array(Arguments *arguments, Py_ssize_t count, Py_ssize_t bytes, int writable)
{
    if (arguments->failed) {
        return NULL;
    }
    Py_buffer *view = &arguments->views[arguments->count];
    if (PyObject_GetBuffer(*arguments->next++, view, PyBUF_C_CONTIGUOUS | (writable ? PyBUF_WRITABLE : 0)) < 0) {
        arguments->failed = 1;
        return NULL;
    }
    arguments->count++;
    if (count >= 0 && view->len != count * bytes) {
        PyErr_Format(PyExc_ValueError, "an array of %zd bytes instead of %zd", view->len, count * bytes);
        arguments->failed = 1;
    }
    return arguments->failed ? NULL : view->buf;
}

#define INPUT(count) array(&arguments, count, sizeof(double), 0)
#define OUTPUT(count) array(&arguments, count, sizeof(double), 1)

/* How many numbers the last array has. */
static Py_ssize_t length(const Arguments *arguments)
{
    return arguments->failed ? 0 : arguments->views[arguments->count - 1].len / (Py_ssize_t)sizeof(double);
}

/* The next array: three numbers for each of so many samples, or none at all. */
static const double *field(Arguments *arguments, Py_ssize_t samples)
{
    const double *values = array(arguments, -1, sizeof(double), 0);
    const Py_ssize_t found = length(arguments);
    if (found != 0 && found != 3 * samples) {
        PyErr_SetString(PyExc_ValueError, "mag has another length than t");
        arguments->failed = 1;
    }
    return found > 0 ? values : NULL;
}

/* Lets the arrays go. Returns None, or NULL after an error. */
static PyObject *release(Arguments *arguments)
{
    while (arguments->count > 0) {
        PyBuffer_Release(&arguments->views[--arguments->count]);
    }
    if (arguments->failed) {
        return NULL;
    }
    Py_RETURN_NONE;
}

/* The next arrays: readings of position, velocity and height for so many samples. */
static void readings(Arguments *arguments, Py_ssize_t samples, lh_rows *rows)
{
    rows->first = array(arguments, samples + 1, sizeof(int64_t), 0);
    const Py_ssize_t seen = rows->first ? (Py_ssize_t)rows->first[samples] : 0;
    rows->row = array(arguments, seen, sizeof(int64_t), 0);
    rows->value = array(arguments, seen, sizeof(double), 0);
    rows->deviation = array(arguments, seen, sizeof(double), 0);
    rows->age = array(arguments, seen, sizeof(double), 0);
}

/* ---- What both kinds of filter have */

/* The filter of a list that has a name; a later list may have a better one. */
#define FIND(found, list, wanted) \
    for (int i = 0; (list)[i]; i++) { \
        (found) = strcmp((list)[i]->name, wanted) == 0 ? (list)[i] : (found); \
    }

/* A method that takes words, and one that gives them. */
#define SETTER(method, Kind, count, set) \
    static PyObject *method(PyObject *object, PyObject *bytes) \
    { \
        const Object *self = (Object *)object; \
        const Kind *filter = self->filter; \
        const lh_word *given = words(bytes, filter->count); \
        if (!given) { \
            return NULL; \
        } \
        filter->set(self->memory, given); \
        Py_RETURN_NONE; \
    }
#define GETTER(method, Kind, count, get) \
    static PyObject *method(PyObject *object, PyObject *unused) \
    { \
        const Object *self = (Object *)object; \
        const Kind *filter = self->filter; \
        lh_word *to; \
        PyObject *bytes = empty_words(filter->count, &to); \
        (void)unused; \
        if (bytes) { \
            filter->get(self->memory, to); \
        } \
        return bytes; \
    }

SETTER(imu_set_settings, lh_imu_filter, settings, set_settings)
SETTER(imu_set_carry, lh_imu_filter, carry, set_carry)
GETTER(imu_carry, lh_imu_filter, carry, get_carry)
SETTER(axis_set_params, lh_axis_filter, params, set_params)
SETTER(axis_set_state, lh_axis_filter, state, set_state)
GETTER(axis_state, lh_axis_filter, state, get_state)

/* A new object with memory for a filter. */
static Object *new_object(PyTypeObject *type, const void *filter, size_t size)
{
    allocfunc alloc = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    Object *self = (Object *)alloc(type, 0);
    if (!self || allocate(self, size) < 0) {
        Py_XDECREF((PyObject *)self);
        return NULL;
    }
    self->filter = filter;
    return self;
}

/* ---- A filter on an IMU */

static PyObject *imu_new(PyTypeObject *type, PyObject *args, PyObject *keywords)
{
    const char *name;
    PyObject *settings, *carry;
    (void)keywords;
    if (!PyArg_ParseTuple(args, "sOO", &name, &settings, &carry)) {
        return NULL;
    }
    const lh_imu_filter *filter = NULL;
    FIND(filter, IMU_FILTERS, name)
    if (lh_wide()) {
        FIND(filter, WIDE_FILTERS, name)
    }
    if (!filter) {
        PyErr_SetString(PyExc_KeyError, name);
        return NULL;
    }
    const lh_word *given = words(settings, filter->settings), *start = words(carry, filter->carry);
    if (!given || !start) {
        return NULL;
    }
    Object *self = new_object(type, filter, filter->size);
    if (!self) {
        return NULL;
    }
    filter->begin(self->memory, given);
    filter->set_carry(self->memory, start);
    return (PyObject *)self;
}

/* One sample, a batch of one row; the orientation after it. */
static PyObject *imu_sample(const Object *self, const double *gyr, const double *acc, const double *mag, double dt)
{
    double quat[4];
    const lh_rows row = {.t = &dt, .gyr = gyr, .acc = acc, .mag = mag, .quat = quat};
    ((const lh_imu_filter *)self->filter)->run(self->memory, 1, 0.0, &row);
    return numbers(quat, 4);
}

static PyObject *imu_tick(PyObject *object, PyObject *const *args, Py_ssize_t count)
{
    double gyr[3], acc[3], dt;
    if (counted(count, 3) < 0 || three(args[0], gyr) < 0 || three(args[1], acc) < 0 || interval(args[2], &dt) < 0) {
        return NULL;
    }
    return imu_sample((const Object *)object, gyr, acc, NULL, dt);
}

static PyObject *imu_tick_mag(PyObject *object, PyObject *const *args, Py_ssize_t count)
{
    double gyr[3], acc[3], mag[3], dt;
    if (counted(count, 4) < 0 || three(args[0], gyr) < 0 || three(args[1], acc) < 0 || three(args[2], mag) < 0
        || interval(args[3], &dt) < 0) {
        return NULL;
    }
    return imu_sample((const Object *)object, gyr, acc, mag, dt);
}

static PyObject *imu_tick_aiding(PyObject *object, PyObject *const *args, Py_ssize_t count)
{
    const Object *self = (Object *)object;
    const lh_imu_filter *filter = self->filter;
    double value, sigma, age;
    if (counted(count, 4) < 0 || number(args[1], &value) < 0 || number(args[2], &sigma) < 0
        || number(args[3], &age) < 0) {
        return NULL;
    }
    const long row = PyLong_AsLong(args[0]);
    if (row == -1 && PyErr_Occurred()) {
        return NULL;
    }
    if (!filter->aid || row < 0) {
        PyErr_Format(PyExc_ValueError, "%s takes no row %ld", filter->name, row);
        return NULL;
    }
    filter->aid(self->memory, (int32_t)row, value, sigma, age);
    Py_RETURN_NONE;
}

static PyObject *imu_report(PyObject *object, PyObject *unused)
{
    const Object *self = (Object *)object;
    double said[11];
    (void)unused;
    ((const lh_imu_filter *)self->filter)->report(self->memory, said);
    return numbers(said, 11);
}

/* run(last, t, gyr, acc, mag, quat, bias, sigma, health), or with first, row, value, deviation, age behind mag and
 * places at the end. */
static PyObject *imu_run(PyObject *object, PyObject *const *args, Py_ssize_t given)
{
    const Object *self = (Object *)object;
    const lh_imu_filter *filter = self->filter;
    const int aided = given == 15;
    Arguments arguments = {.next = args + 1};
    lh_rows rows = {0};
    double last;
    if (!filter->run) {
        return PyErr_Format(PyExc_ValueError, "%s only runs forward for its smoother", filter->name);
    }
    if (aided && !filter->aid) {
        return PyErr_Format(PyExc_ValueError, "%s takes no aiding", filter->name);
    }
    if ((!aided && counted(given, 9) < 0) || number(args[0], &last) < 0) {
        return NULL;
    }
    rows.t = INPUT(-1);
    const Py_ssize_t count = length(&arguments);
    rows.gyr = INPUT(3 * count);
    rows.acc = INPUT(3 * count);
    rows.mag = field(&arguments, count);
    if (aided) {
        readings(&arguments, count, &rows);
    }
    rows.quat = OUTPUT(4 * count);
    rows.bias = OUTPUT(3 * count);
    rows.sigma = OUTPUT(3 * count);
    rows.health = array(&arguments, count, sizeof *rows.health, 1);
    if (aided) {
        rows.places = OUTPUT(12 * count);
    }
    if (!arguments.failed) {
        Py_BEGIN_ALLOW_THREADS
        filter->run(self->memory, count, last, &rows);
        Py_END_ALLOW_THREADS
    }
    return release(&arguments);
}

/* run_rows(dt, gyr, acc, mag, quat): samples with their intervals; the orientation alone. */
static PyObject *imu_run_rows(PyObject *object, PyObject *const *args, Py_ssize_t given)
{
    const Object *self = (Object *)object;
    const lh_imu_filter *filter = self->filter;
    Arguments arguments = {.next = args};
    lh_rows rows = {0};
    if (!filter->run) {
        return PyErr_Format(PyExc_ValueError, "%s only runs forward for its smoother", filter->name);
    }
    if (counted(given, 5) < 0) {
        return NULL;
    }
    rows.dt = INPUT(-1);
    const Py_ssize_t count = length(&arguments);
    rows.gyr = INPUT(3 * count);
    rows.acc = INPUT(3 * count);
    rows.mag = field(&arguments, count);
    rows.quat = OUTPUT(4 * count);
    if (!arguments.failed) {
        Py_BEGIN_ALLOW_THREADS
        filter->run(self->memory, count, 0.0, &rows);
        Py_END_ALLOW_THREADS
    }
    return release(&arguments);
}

/* forward(last, start, t, gyr, acc, mag, quat, health, numbers, end), or with first, row, value, deviation, age and
 * places at the end: how many blocks were kept, and the sample after the last one. */
static PyObject *imu_forward(PyObject *object, PyObject *const *args, Py_ssize_t given)
{
    const Object *self = (Object *)object;
    const lh_imu_filter *filter = self->filter;
    Arguments arguments = {.next = args + 2};
    lh_rows rows = {0};
    lh_blocks blocks = {0};
    double last;
    if (!filter->forward) {
        return PyErr_Format(PyExc_ValueError, "%s keeps no blocks", filter->name);
    }
    if (counted(given, filter->aid ? 16 : 10) < 0 || number(args[0], &last) < 0) {
        return NULL;
    }
    const Py_ssize_t start = PyLong_AsSsize_t(args[1]);
    if (start < 0) {
        return PyErr_Occurred() ? NULL : PyErr_Format(PyExc_ValueError, "start %zd", start);
    }
    rows.t = INPUT(-1);
    const Py_ssize_t count = length(&arguments);
    rows.gyr = INPUT(3 * count);
    rows.acc = INPUT(3 * count);
    rows.mag = field(&arguments, count);
    rows.quat = OUTPUT(4 * count);
    rows.health = array(&arguments, count, sizeof *rows.health, 1);
    blocks.numbers = OUTPUT(-1);
    blocks.room = (int32_t)(length(&arguments) / filter->width);
    blocks.end = OUTPUT(blocks.room);
    if (filter->aid) {
        readings(&arguments, count, &rows);
        rows.places = OUTPUT(12 * count);
    }
    int32_t kept = 0;
    ptrdiff_t stop = 0;
    if (!arguments.failed) {
        Py_BEGIN_ALLOW_THREADS
        stop = filter->forward(self->memory, start, count, last, &rows, &blocks, &kept);
        Py_END_ALLOW_THREADS
    }
    PyObject *none = release(&arguments);
    Py_XDECREF(none);
    return none ? Py_BuildValue("(in)", (int)kept, (Py_ssize_t)stop) : NULL;
}

static PyMethodDef imu_methods[] = {
    {"set_params", imu_set_settings, METH_O, NULL},
    {"set_state", imu_set_carry, METH_O, NULL},
    {"state", imu_carry, METH_NOARGS, NULL},
    {"tick", (PyCFunction)(void (*)(void))imu_tick, METH_FASTCALL, NULL},
    {"tick_mag", (PyCFunction)(void (*)(void))imu_tick_mag, METH_FASTCALL, NULL},
    {"tick_aiding", (PyCFunction)(void (*)(void))imu_tick_aiding, METH_FASTCALL, NULL},
    {"report", imu_report, METH_NOARGS, NULL},
    {"run", (PyCFunction)(void (*)(void))imu_run, METH_FASTCALL, NULL},
    {"run_rows", (PyCFunction)(void (*)(void))imu_run_rows, METH_FASTCALL, NULL},
    {"forward", (PyCFunction)(void (*)(void))imu_forward, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot imu_slots[] = {
    {Py_tp_new, imu_new},
    {Py_tp_dealloc, deallocate},
    {Py_tp_methods, imu_methods},
    {0, NULL},
};

static PyType_Spec imu_spec = {
    .name = "levelhead.engine._native.Imu",
    .basicsize = sizeof(Object),
    .flags = Py_TPFLAGS_DEFAULT,
    .slots = imu_slots,
};

/* ---- A filter on one level and its rate */

static PyObject *axis_new(PyTypeObject *type, PyObject *args, PyObject *keywords)
{
    const char *name;
    PyObject *params, *state;
    (void)keywords;
    if (!PyArg_ParseTuple(args, "sOO", &name, &params, &state)) {
        return NULL;
    }
    const lh_axis_filter *filter = NULL;
    FIND(filter, AXIS_FILTERS, name)
    if (!filter) {
        PyErr_SetString(PyExc_KeyError, name);
        return NULL;
    }
    const lh_word *given = words(params, filter->params), *start = words(state, filter->state);
    if (!given || !start) {
        return NULL;
    }
    Object *self = new_object(type, filter, filter->size);
    if (!self) {
        return NULL;
    }
    filter->set_params(self->memory, given);
    filter->set_state(self->memory, start);
    return (PyObject *)self;
}

/* tick(period, level, rate, dt) */
static PyObject *axis_tick(PyObject *object, PyObject *const *args, Py_ssize_t count)
{
    const Object *self = (Object *)object;
    double period, level, rate, dt;
    if (counted(count, 4) < 0 || number(args[0], &period) < 0 || number(args[1], &level) < 0
        || number(args[2], &rate) < 0 || interval(args[3], &dt) < 0) {
        return NULL;
    }
    if (!(level - level == 0.0 && rate - rate == 0.0)) {
        PyErr_SetString(PyExc_ValueError, "level or rate");
        return NULL;
    }
    return PyFloat_FromDouble(((const lh_axis_filter *)self->filter)->tick(self->memory, period, level, rate, dt));
}

/* run(t, level, rate, period, report) */
static PyObject *axis_run(PyObject *object, PyObject *const *args, Py_ssize_t given)
{
    const Object *self = (Object *)object;
    const lh_axis_filter *filter = self->filter;
    Arguments arguments = {.next = args};
    double period;
    if (counted(given, 5) < 0 || number(args[3], &period) < 0) {
        return NULL;
    }
    const double *t = INPUT(-1);
    const Py_ssize_t count = length(&arguments);
    const double *level = INPUT(count), *rate = INPUT(count);
    arguments.next++; /* the period */
    double *report = OUTPUT(count * filter->report);
    if (!arguments.failed && count > 0) {
        Py_BEGIN_ALLOW_THREADS
        filter->run(self->memory, count, t, level, rate, period, report);
        Py_END_ALLOW_THREADS
    }
    return release(&arguments);
}

static PyMethodDef axis_methods[] = {
    {"set_params", axis_set_params, METH_O, NULL},
    {"set_state", axis_set_state, METH_O, NULL},
    {"state", axis_state, METH_NOARGS, NULL},
    {"tick", (PyCFunction)(void (*)(void))axis_tick, METH_FASTCALL, NULL},
    {"run", (PyCFunction)(void (*)(void))axis_run, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot axis_slots[] = {
    {Py_tp_new, axis_new},
    {Py_tp_dealloc, deallocate},
    {Py_tp_methods, axis_methods},
    {0, NULL},
};

static PyType_Spec axis_spec = {
    .name = "levelhead.engine._native.Axis",
    .basicsize = sizeof(Object),
    .flags = Py_TPFLAGS_DEFAULT,
    .slots = axis_slots,
};

/* ---- The smoother's way back */

/* correct_stretch(name, count, stop, t, numbers, end, memory, turn, before, bias, sigma, quat, biases, sigmas), or with
 * nav_end, nav_before, nav behind them */
static PyObject *correct_stretch(PyObject *module, PyObject *const *args, Py_ssize_t given)
{
    const lh_smoother *smoother = NULL;
    Arguments arguments = {.next = args + 3};
    lh_stretch s = {0};
    (void)module;
    if (given != 17 && counted(given, 14) < 0) {
        return NULL;
    }
    const char *name = PyUnicode_AsUTF8AndSize(args[0], NULL);
    if (!name) {
        return NULL;
    }
    FIND(smoother, SMOOTHERS, name)
    if (lh_wide()) {
        FIND(smoother, WIDE_SMOOTHERS, name)
    }
    if (lh_widest()) {
        FIND(smoother, WIDEST_SMOOTHERS, name)
    }
    if (!smoother) {
        return PyErr_Format(PyExc_KeyError, "%s", name);
    }
    if (counted(given, smoother->aided ? 17 : 14) < 0) {
        return NULL;
    }
    const long count = PyLong_AsLong(args[1]), stop = PyLong_AsLong(args[2]);
    if (PyErr_Occurred()) {
        return NULL;
    }
    s.t = INPUT(-1);
    const Py_ssize_t rows = length(&arguments);
    s.numbers = INPUT(-1);
    const Py_ssize_t room = length(&arguments) / smoother->width;
    s.end = INPUT(room);
    s.memory = OUTPUT(smoother->memory);
    double **const blocks[] = {&s.turn, &s.before, &s.bias, &s.sigma};
    for (int i = 0; i < 4; i++) {
        *blocks[i] = OUTPUT(3 * count);
    }
    s.quat = OUTPUT(4 * rows);
    s.biases = OUTPUT(3 * rows);
    s.sigmas = OUTPUT(3 * rows);
    if (smoother->aided) {
        s.nav_end = OUTPUT(12 * count);
        s.nav_before = OUTPUT(6 * count);
        s.nav = OUTPUT(12 * rows);
    }
    if (!arguments.failed && !(0 < count && count <= room && 0 < stop && stop <= rows)) {
        PyErr_Format(PyExc_ValueError, "%ld blocks up to sample %ld", count, stop);
        arguments.failed = 1;
    }
    if (!arguments.failed) {
        s.count = (int32_t)count;
        s.stop = (int32_t)stop;
        Py_BEGIN_ALLOW_THREADS
        smoother->correct(&s);
        Py_END_ALLOW_THREADS
    }
    return release(&arguments);
}

static PyMethodDef module_methods[] = {
    {"correct_stretch", (PyCFunction)(void (*)(void))correct_stretch, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};

/* ---- The module */

/* Adds name -> (files, digest, formats of parameters and of state) to a dictionary. */
#define ADD(to, filter, params, state) \
    add(to, (filter)->name, Py_BuildValue("(ssss)", (filter)->files, (filter)->digest, (filter)->params, (filter)->state))
static int add(PyObject *to, const char *name, PyObject *entry)
{
    const int done = entry ? PyDict_SetItemString(to, name, entry) : -1;
    Py_XDECREF(entry);
    return done;
}

static int execute(PyObject *module)
{
    PyObject *imu = PyDict_New(), *axis = PyDict_New(), *smoothers = PyDict_New();
    int good = imu && axis && smoothers;
    for (int i = 0; good && IMU_FILTERS[i]; i++) {
        good = ADD(imu, IMU_FILTERS[i], settings_format, carry_format) == 0;
    }
    for (int i = 0; good && AXIS_FILTERS[i]; i++) {
        good = ADD(axis, AXIS_FILTERS[i], params_format, state_format) == 0;
    }
    for (int i = 0; good && SMOOTHERS[i]; i++) {
        const lh_smoother *one = SMOOTHERS[i];
        good = add(smoothers, one->name, Py_BuildValue("(ssss)", one->files, one->digest, "", "")) == 0;
    }
    good = good && PyModule_AddObjectRef(module, "SMOOTHERS", smoothers) == 0
        && PyModule_AddObjectRef(module, "IMU_FILTERS", imu) == 0
        && PyModule_AddObjectRef(module, "AXIS_FILTERS", axis) == 0;
    PyObject *types[2] = {PyType_FromSpec(&imu_spec), PyType_FromSpec(&axis_spec)};
    good = good && types[0] && PyModule_AddObjectRef(module, "Imu", types[0]) == 0;
    good = good && types[1] && PyModule_AddObjectRef(module, "Axis", types[1]) == 0;
    Py_XDECREF(types[0]);
    Py_XDECREF(types[1]);
    Py_XDECREF(imu);
    Py_XDECREF(axis);
    Py_XDECREF(smoothers);
    return good ? 0 : -1;
}

static PyModuleDef_Slot module_slots[] = {
    {Py_mod_exec, execute},
    {0, NULL},
};

static PyModuleDef definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "_native",
    .m_doc = "The filters of the house, compiled when the package was built.",
    .m_size = 0,
    .m_methods = module_methods,
    .m_slots = module_slots,
};

PyMODINIT_FUNC PyInit__native(void)
{
    return PyModuleDef_Init(&definition);
}
