/* Stubs of the frameworks for the examples in Lines, on this machine: the console is standard input and output. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef ZEPHYR
void console_getline_init(void) {}

char *console_getline(void)
{
    static char line[64];
    if (fgets(line, sizeof line, stdin) == NULL) {
        exit(0);
    }
    line[strcspn(line, "\n")] = 0;
    return line;
}

void printk(const char *format, ...)
{
    va_list values;
    va_start(values, format);
    vprintf(format, values);
    va_end(values);
}
#else
void app_main(void);

void vTaskDelay(unsigned ticks) { exit(ticks == 0); }

int main(void)
{
    app_main();
    return 1;
}
#endif
