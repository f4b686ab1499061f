/* An exporter whose model is empty: what the harness itself takes. It compares nothing in floats, which would hide the routine. */
int peer_start(void);
int peer_class(const float *row);

int peer_start(void)
{
    return 0;
}

int peer_class(const float *row)
{
    return row == 0;
}
