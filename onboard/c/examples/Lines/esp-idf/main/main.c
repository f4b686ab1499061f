/* ESP-IDF: a line of standard input is a touch, and is answered with the verdict. */
#include "lines.h"

#include "esp_log.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

void app_main(void)
{
    char line[64], answer[80];
    if (lines_begin() != 0) {
        ESP_LOGE("palpate", "This is no model; wrong at byte %u", (unsigned)model.wrong);
        return;
    }
    while (1) {
        if (fgets(line, sizeof line, stdin) == NULL) {
            vTaskDelay(1); /* nothing was typed yet */
            continue;
        }
        lines_answer(line, answer, sizeof answer);
        puts(answer);
    }
}
