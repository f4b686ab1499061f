/* Stub with as much of ESP-IDF as the example needs, so that a compiler can check it. */
#include <stdio.h>
#define ESP_LOGE(tag, format, ...) fprintf(stderr, "%s: " format "\n", tag, __VA_ARGS__)
