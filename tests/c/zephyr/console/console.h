/* Stub with as much of Zephyr as the example needs, so that a compiler can check it. */
void console_getline_init(void);
char *console_getline(void);
