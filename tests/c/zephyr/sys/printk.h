/* Stub with as much of Zephyr as the example needs, so that a compiler can check it. */
void printk(const char *format, ...) __attribute__((format(printf, 1, 2)));
