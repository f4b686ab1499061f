/* Zephyr: a line of the console is a touch, and is answered with the verdict. */
#include "lines.h"

#include <zephyr/console/console.h>
#include <zephyr/sys/printk.h>

int main(void)
{
    char answer[80];
    if (lines_begin() != 0) {
        printk("This is no model; wrong at byte %u\n", (unsigned)model.wrong);
        return 0;
    }
    console_getline_init();
    while (1) {
        lines_answer(console_getline(), answer, sizeof answer);
        printk("%s\n", answer);
    }
}
