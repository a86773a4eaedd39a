/* What functions that are compiled ahead of time need when they are called without numba, see hsv/ahead_of_time.py:
 * memory for the arrays that they make, and the arrays and lanes that they are given.
 *
 * Python's and numpy's headers need not be there: what is used of them has been the same in all their versions. */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Memory: names and fields are those of numba's run time (runtime/nrt.cpp). */

struct MemInfo {
    size_t references;
    void (*destructor)(void *data, size_t size, void *info);
    void *destructor_info;
    void *data;
    size_t size;
    void *external_allocator;
};

void *NRT_Allocate(size_t size) { return malloc(size); }

void NRT_Free(void *pointer) { free(pointer); }

struct MemInfo *NRT_MemInfo_alloc_aligned(size_t size, unsigned align)
{
    struct MemInfo *memory = malloc(sizeof *memory + size + align);
    if (memory == NULL)
        return NULL;
    uintptr_t data = (uintptr_t)(memory + 1);
    data += (align - data % align) % align;
    *memory = (struct MemInfo){1, NULL, NULL, (void *)data, size, NULL};
    return memory;
}

void NRT_MemInfo_call_dtor(struct MemInfo *memory) { free(memory); }

/* Gives back an array that a function has returned; memory of the caller has none of these. */
void hsv_release(struct MemInfo *memory)
{
    if (memory != NULL && __atomic_sub_fetch(&memory->references, 1, __ATOMIC_ACQ_REL) == 0)
        free(memory);
}

/* Arrays that are given. */

struct Object {
    intptr_t references;
    void *type;
};

struct Type {
    struct Object head;
    void *scalar;
    char kind, letter, byte_order, flags;
    int number;
};

struct Array { /* PyArrayObject_fields of numpy's C interface */
    struct Object head;
    char *data;
    int axes;
    intptr_t *shape, *strides;
    struct Object *base;
    struct Type *type;
    int flags;
};

extern void *PyExc_TypeError;
void PyErr_SetString(void *type, const char *text);

static void *array_type;
static intptr_t no_lengths[64]; /* as many axes as numpy admits */
static const struct Array no_array = {.shape = no_lengths, .strides = no_lengths};

/* Says what numpy.ndarray is, before anything else is called. */
void hsv_begin(void *type) { array_type = type; }

/* An array with so many axes and these flags of numpy's, of a type by its number; else an empty one, and an error of
 * Python's. */
const struct Array *hsv_array(struct Object *object, int64_t axes, int64_t number, int64_t flags)
{
    const struct Array *array = (const struct Array *)object;
    if (object->type == array_type && array->axes == axes && array->type->number == number &&
        array->type->byte_order != '>' && (array->flags & flags) == flags)
        return array;
    PyErr_SetString(PyExc_TypeError, "expected an array of the type and order that was compiled for");
    return &no_array;
}

/* Lanes that are given, see hsv/lane_arrays.py. */

void *PyErr_Occurred(void);
void *PyErr_Format(void *type, const char *format, ...);
void *PyObject_GetAttrString(void *object, const char *name);
const char *PyUnicode_AsUTF8(void *text);
void *PyTuple_GetItem(void *tuple, intptr_t index);
long long PyLong_AsLongLong(void *number);
void Py_DecRef(void *object);

static int64_t number_of(void *object, const char *name)
{
    void *value = PyObject_GetAttrString(object, name);
    int64_t number = PyLong_AsLongLong(value);
    Py_DecRef(value);
    return number;
}

/* Writes address and, of an array, stride and lengths of lanes of a kind; else 0, and there is an error of Python's. */
void hsv_lanes(void *object, const char *kind, int64_t axes, int64_t *found)
{
    for (int64_t i = 0; i < axes + 2; i++)
        found[i] = 0;
    if (PyErr_Occurred() != NULL) /* to look for an attribute would clear it */
        return;
    void *name = PyObject_GetAttrString(object, "kind");
    const char *text = name == NULL ? NULL : PyUnicode_AsUTF8(name);
    int fits = text != NULL && strcmp(text, kind) == 0;
    Py_DecRef(name);
    if (!fits) {
        PyErr_Format(PyExc_TypeError, "expected a %s", kind);
        return;
    }
    found[0] = number_of(object, "address");
    if (axes == 0)
        return;
    found[1] = number_of(object, "stride");
    void *shape = PyObject_GetAttrString(object, "shape");
    for (int64_t i = 0; i < axes; i++)
        found[i + 2] = PyLong_AsLongLong(PyTuple_GetItem(shape, i));
    Py_DecRef(shape);
}
