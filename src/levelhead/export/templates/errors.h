
/* What it has learned of its sensor, each with its 1 sigma; zero of a magnetometer that was never there. */
typedef struct {
$fields
} ${name}_learned;

${name}_learned ${name}_learned_errors(const $name *filter);
