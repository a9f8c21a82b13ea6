/* Puts EMBREE_CONFIG before the configuration that embreex gives Embree's rtcNewDevice, and writes to stderr what came
 * of it: how wide the packets are that the device takes natively (4: SSE2, 8: AVX and AVX2, 16: AVX-512).
 *
 * gcc -shared -fPIC embree_isa.c -o embree_isa.so -ldl; LD_PRELOAD=./embree_isa.so EMBREE_CONFIG=isa=sse2 python ...
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <link.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char embree[4096];

static int find_embree(struct dl_phdr_info *info, size_t size, void *data)
{
    (void)size;
    (void)data;
    if (!strstr(info->dlpi_name, "libembree4"))
        return 0;
    snprintf(embree, sizeof embree, "%s", info->dlpi_name);
    return 1;
}

void *rtcNewDevice(const char *config)
{
    /* embreex loads Embree for itself alone, where RTLD_NEXT does not look. */
    if (!dl_iterate_phdr(find_embree, NULL)) {
        fprintf(stderr, "embree_isa: no libembree4 is loaded\n");
        abort();
    }
    void *library = dlopen(embree, RTLD_LAZY | RTLD_NOLOAD);
    void *(*new_device)(const char *) = (void *(*)(const char *))dlsym(library, "rtcNewDevice");
    long (*property)(void *, int) = (long (*)(void *, int))dlsym(library, "rtcGetDeviceProperty");
    if (!new_device || !property) {
        fprintf(stderr, "embree_isa: %s\n", dlerror());
        abort();
    }
    const char *wanted = getenv("EMBREE_CONFIG");
    char text[1024];
    snprintf(text, sizeof text, "%s,%s", wanted ? wanted : "", config ? config : "");
    void *device = new_device(text);
    /* RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED, RAY8, RAY16 */
    fprintf(stderr, "embree_isa %s widths", wanted ? wanted : "");
    for (int k = 0; k < 3; k++)
        if (property(device, 32 + k))
            fprintf(stderr, " %d", 4 << k);
    fprintf(stderr, "\n");
    return device;
}
