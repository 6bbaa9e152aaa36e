#ifndef LINO_BASE_CONFIG_H
#define COUNTS_PER_REV1 9900   // wheel1 encoder's no of ticks per rev
#define COUNTS_PER_REV2 10101
#define WHEEL_DIAMETER 0.1999899 // wheel's diameter in meters
#define LR_WHEELS_DISTANCE 0.408
#endif
